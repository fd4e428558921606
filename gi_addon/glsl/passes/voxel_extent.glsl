// Where the sums of a cell keep how far each sheet reaches over the cell's face, in units of 1/255 of it.

const float EXTENT_UNITS = 255.0;

uint sheet_extent(uint first, int part) { return first + 33u + 4u * uint(part); }
