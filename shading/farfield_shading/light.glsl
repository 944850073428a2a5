// Farfield's light model: diffuse and independent of the eye, so that a picture taken from a view
// cell's centre is right from everywhere in the cell. Valid in GLSL 3.30 and GLSL ES 3.00; the same
// text is compiled by the baker, by `farfield shoot` and by the viewer. The numbers come from
// light.json (and, in a walk, from walk.json's "light"). All colours here are linear.

uniform vec3 ff_ambient;
uniform vec3 ff_sun_direction; // unit vector towards the sun
uniform vec3 ff_sun;
uniform vec3 ff_hemisphere_up;
uniform vec3 ff_hemisphere_down;
uniform vec3 ff_sky_zenith;
uniform vec3 ff_sky_horizon;
uniform vec3 ff_sky_ground;

// Light that falls on a surface with unit normal n.
vec3 ff_irradiance(vec3 n) {
  return ff_ambient + ff_sun * max(dot(n, ff_sun_direction), 0.0)
    + mix(ff_hemisphere_down, ff_hemisphere_up, 0.5 + 0.5 * n.y);
}

// Colour of a lit surface; an unlit one shows its base colour as it is.
vec3 ff_shade(vec3 base, vec3 n, vec3 emissive, float unlit) {
  return clamp(mix(base * ff_irradiance(n) + emissive, base, unlit), 0.0, 1.0);
}

// IEC 61966-2-1 transfer function, linear -> sRGB.
vec3 ff_to_srgb(vec3 c) {
  return mix(12.92 * c, 1.055 * pow(max(c, vec3(0.0031308)), vec3(1.0 / 2.4)) - 0.055,
    step(vec3(0.0031308), c));
}

// The background in a direction of any length.
vec3 ff_sky(vec3 direction) {
  float y = normalize(direction).y;
  return y >= 0.0 ? mix(ff_sky_horizon, ff_sky_zenith, sqrt(y))
    : mix(ff_sky_horizon, ff_sky_ground, sqrt(-y));
}

// Does a translucent sample of opacity `alpha` draw this pixel? Order-independent, keeps the
// average coverage: the 4x4 ordered dither of Bayer (1973).
bool ff_dither(float alpha, vec2 pixel) {
  ivec2 p = ivec2(pixel) & 3;
  int x = p.x ^ p.y;
  int rank = ((x & 1) << 3) | ((p.y & 1) << 2) | (x & 2) | ((p.y & 2) >> 1);
  return alpha > (float(rank) + 0.5) / 16.0;
}
