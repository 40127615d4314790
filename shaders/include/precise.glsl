// Functions that a device may only approximate (the specification allows sin and cos an absolute error of 2^-11, atan 4096
// units in the last place) to single precision. Polynomials: Cephes (Moshier 1992).
#ifndef PRECISE_GLSL
#define PRECISE_GLSL

// Arc tangent of y/x for y >= 0: 0..π.
float precise_angle(float y, float x) {
    float a = abs(x);
    float t = min(y, a) / max(y, a);
    float base = 0.0;
    if (t > 0.4142135623730950) {
        t = (t - 1.0) / (t + 1.0);
        base = 0.785398163397448;
    }
    float z = t * t;
    float angle = base + ((((8.05374449538e-2 * z - 1.38776856032e-1) * z + 1.99777106478e-1) * z - 3.33329491539e-1) * z * t + t);
    if (y > a) angle = 1.570796326794897 - angle;
    return x < 0.0 ? 3.141592653589793 - angle : angle;
}

// (sin, cos) of an angle of 0..2π.
vec2 precise_sin_cos(float angle) {
    float k = floor(angle * 0.636619772367581 + 0.5);
    // π/2 in three parts.
    float r = ((angle - k * 1.5703125) - k * 4.837512969970703e-4) - k * 7.549789948768648e-8;
    float z = r * r;
    float s = ((-1.9515295891e-4 * z + 8.3321608736e-3) * z - 1.6666654611e-1) * z * r + r;
    float c = ((2.443315711809948e-5 * z - 1.388731625493765e-3) * z + 4.166664568298827e-2) * z * z - 0.5 * z + 1.0;
    uint quadrant = uint(k) & 3u;
    vec2 sc = (quadrant & 1u) != 0u ? vec2(c, -s) : vec2(s, c);
    return quadrant >= 2u ? -sc : sc;
}

#endif
