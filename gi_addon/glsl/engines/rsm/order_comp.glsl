// First-bounce lights in an order in which neighbours in the list are neighbours in a light's map: of such a list systematic
// resampling (gather_all_lib.glsl) draws an even choice of places. Each finds its rank by comparing all keys.

layout(local_size_x = 64) in;

void main()
{
    int i = int(gl_GlobalInvocationID.x);
    if (i >= vpl_count) {
        return;
    }
    Vpl vpl = drawn_vpls[i];
    int rank = 0;
    for (int k = 0; k < vpl_count; ++k) {
        uint key = drawn_vpls[k].key;
        rank += int(key < vpl.key || (key == vpl.key && k < i));
    }
    vpls[rank] = vpl;
}
