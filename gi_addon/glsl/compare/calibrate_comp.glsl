// A fixed amount of work that tells this machine from another, and a warm one from a cold one.
//
// arithmetic: 512 rounds of 4 × 4 independent fused multiply-adds for each invocation, 16 384 floating-point operations
// whose factors only keep the numbers from growing and from vanishing;
// bandwidth: each invocation moves 64 bytes in and 64 bytes out, neighbours side by side.

layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer source_block { vec4 source[]; };
layout(std430, binding = 1) buffer target_block { vec4 target[]; };
uniform uint stride;

void main()
{
    uint i = gl_GlobalInvocationID.x;
#if ARITHMETIC
    vec4 a = source[i], b = a.yzwx, c = a.zwxy, d = a.wxyz;
    for (int k = 0; k < 512; k++) {
        a = a * 0.999 + 0.001;
        b = b * 0.998 + 0.002;
        c = c * 0.997 + 0.003;
        d = d * 0.996 + 0.004;
    }
    target[i] = a + b + c + d;
#else
    for (uint k = 0u; k < 4u; k++) {
        target[i + k * stride] = source[i + k * stride];
    }
#endif
}
