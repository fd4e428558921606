// What IndirectLighting notes of each pixel beside its light.

const float NOT_WANTED = 0.0;
const float INTERPOLATED = 1.0;
const float GATHERED = 2.0;
