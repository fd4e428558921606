// Blocks of RSM texels: texels of the flux pyramid's level BLOCK_LEVEL. Included after rsm_lib.glsl, where rsm_views are declared.

// The view whose tile holds place `at` of the atlas (texels), −1 for none.
int view_at(vec2 at)
{
    int index = -1;
    for (int k = 0; k < view_count; ++k) {
        vec2 inside = at - rsm_views[k].rect.xy;
        index = all(greaterThanEqual(inside, vec2(0.0))) && all(lessThan(inside, rsm_views[k].rect.zw)) ? k : index;
    }
    return index;
}

// The light whose map a block is of, −1 for none.
int block_light(ivec2 block)
{
    int index = view_at(vec2(block << BLOCK_LEVEL) + 0.5);
    return index < 0 ? -1 : rsm_views[index].light;
}
