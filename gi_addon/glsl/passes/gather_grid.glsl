// Where the grid of low-resolution blocks starts in this sub-frame, in pixels left and below of the picture's corner.
// Included after view_lib and sequence_lib, with GATHER_SCALE defined.

#if GATHER_SCALE == 1
ivec2 gather_grid_offset() { return ivec2(0); }
#else
// Once an invocation: blocks are read in loops.
ivec2 gather_grid_offset_now = ivec2(sobol_2d(view.subframe, 6u) * float(GATHER_SCALE));
ivec2 gather_grid_offset() { return gather_grid_offset_now; }
#endif

// The pixel that block `block` picked, from its packed place.
ivec2 gather_grid_pixel(ivec2 block, vec2 packed_place)
{
    return block * GATHER_SCALE + ivec2(floor(packed_place * float(GATHER_SCALE))) - gather_grid_offset();
}
