// What a sheet's words of sums hold (passes/voxels.py counts them). What is of a whole cell is with its first sheet.

#include "passes/voxel_store.glsl"

const uint SUM_AREA = 0u;     // of the cell: area of surface, and area × opacity, in VOXEL_UNITS of a cell's face
const uint SUM_OPAQUE = 1u;
const uint SUM_ALBEDO = 2u;   // of the cell: × albedo, three words
const uint SUM_DIFFUSE = 5u;  // of the cell: × how much of it is diffuse
const uint SUM_SHARE = 6u;    // of the sheet: area of its shadow
const uint SUM_PLANE = 7u;    // × slopes and height
const uint SUM_SQUARES = 10u; // squares covered, a bit each
const uint SUM_EXTENT = 11u;  // how far it reaches over the cell's face, in units of 1/255 of it, four words
const uint SUM_LAMPS = 15u;   // of the sheet, with VOXEL_LAMPS: area of lamps
const uint SUM_EMISSION = 15u; // of the cell, with VOXEL_EMISSION: × emission, three words
const float EXTENT_UNITS = 255.0;

// In the kinds of a cell in the making: something in it is not wholly see-through. Without it the cell is empty.
const uint SOME_OPAQUE = 64u;
