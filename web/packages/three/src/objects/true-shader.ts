/**
 * Rays into height fields (Risser, "True Impostors", GPU Gems 3, chapter 21): a quad in front of
 * the object is drawn, and every pixel's line of sight is followed through the object's box. All is
 * computed in the object's own space, in which the box is [0, 1]³ and heights run along z.
 */

import { FADE_GLSL } from '../fade.js';
import { CLIP_GLSL } from '../projection.js';
import { LIGHT_GLSL } from '../shading.generated.js';

export const TRUE_VERTEX = `
precision highp float;
uniform mat4 modelViewMatrix;
uniform mat4 projectionMatrix;
uniform vec3 ff_eye;    // in the group's space
uniform vec3 ff_middle; // of the box, metres
uniform vec3 ff_half;   // half its edges
uniform float ff_focal; // pixels per unit of slope
in vec3 position;
in vec4 ff_place; // where the object's origin is; scale
in vec4 ff_turn;  // unit quaternion
flat out vec4 v_turn;
flat out vec4 v_place;
flat out vec3 v_eye; // the eye in the object's space, metres
flat out float v_pixels;
out vec3 v_point;
${CLIP_GLSL}
vec3 turn(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
void main() {
  vec4 back = vec4(-ff_turn.xyz, ff_turn.w);
  v_turn = ff_turn;
  v_place = ff_place;
  v_eye = turn(back, ff_eye - ff_place.xyz) / ff_place.w;
  vec3 to = ff_middle - v_eye;
  float away = length(to);
  vec3 forward = to / away;
  vec3 right = normalize(abs(forward.y) < 0.9 ? cross(forward, vec3(0.0, 1.0, 0.0))
    : cross(forward, vec3(1.0, 0.0, 0.0)));
  vec3 up = cross(right, forward);
  // The box's reach along each axis; what is nearer than its middle looks larger.
  vec3 reach = vec3(dot(abs(right), ff_half), dot(abs(up), ff_half), dot(abs(forward), ff_half));
  float nearest = max(away - reach.z, 0.05 * away);
  vec2 size = reach.xy * away / nearest;
  v_pixels = 2.0 * ff_focal * length(ff_half) / away;
  v_point = ff_middle + position.x * size.x * right + position.y * size.y * up;
  vec3 at = ff_place.xyz + ff_place.w * turn(ff_turn, v_point);
  gl_Position = ff_clip(projectionMatrix, modelViewMatrix * vec4(at, 1.0));
}
`;

export const TRUE_FRAGMENT = `
precision highp float;
precision highp int;
precision highp sampler2DArray;
uniform mat4 modelViewMatrix;
uniform mat4 projectionMatrix;
uniform mat3 ff_axes; // the box's axes -> texture x, texture y, height
uniform vec3 ff_middle;
uniform vec3 ff_half;
uniform sampler2DArray ff_fields;
uniform float ff_index;  // of refraction
uniform vec3 ff_absorb;  // per metre
flat in vec4 v_turn;
flat in vec4 v_place;
flat in vec3 v_eye;
flat in float v_pixels;
in vec3 v_point;
out vec4 color;
${CLIP_GLSL}
${LIGHT_GLSL}
${FADE_GLSL}
vec3 turn(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }

// Metres -> the unit box.
vec3 to_unit(vec3 p) { return ff_axes * ((p - ff_middle) / (2.0 * ff_half)) + 0.5; }

ivec2 texel_of(vec3 q) {
  ivec2 size = textureSize(ff_fields, 0).xy;
  return clamp(ivec2(floor(q.xy * vec2(size))), ivec2(0), size - 1);
}

// How deep a point is in a slab, in heights; negative outside of all.
float depth_in(vec3 q) {
  ivec2 at = texel_of(q);
  float depth = -1.0;
  for (int n = 0; n < TEXTURES; n++) {
    vec4 h = texelFetch(ff_fields, ivec3(at, n), 0);
    vec2 deep = min(q.zz - h.xz, h.yw - q.zz);
    depth = max(depth, max(h.y >= h.x ? deep.x : -1.0, h.w >= h.z ? deep.y : -1.0));
  }
  return depth;
}

bool inside(vec3 q) { return depth_in(q) >= 0.0; }

// The layer that holds the colour of the surface nearest in height; the next one holds its normal.
int surface_of(vec3 q) {
  ivec2 at = texel_of(q);
  float best = 2.0;
  int layer = TEXTURES;
  for (int n = 0; n < TEXTURES; n++) {
    vec4 h = texelFetch(ff_fields, ivec3(at, n), 0);
    vec4 off = abs(h - q.z);
    if (h.y < h.x) off.xy = vec2(2.0);
    if (h.w < h.z) off.zw = vec2(2.0);
    for (int c = 0; c < 4; c++) {
      if (off[c] >= best) continue;
      best = off[c];
      layer = TEXTURES + 2 * (4 * n + c);
    }
  }
  return layer;
}

vec3 normal_at(vec3 q) {
  vec3 n = texelFetch(ff_fields, ivec3(texel_of(q), surface_of(q) + 1), 0).rgb;
  return normalize(2.0 * n - 1.0 + 1e-4);
}

vec3 to_linear(vec3 c) {
  return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(vec3(0.04045), c));
}

// Where a ray enters and leaves the box.
vec2 cross_box(vec3 origin, vec3 ray) {
  vec3 inverse = 1.0 / (ray + vec3(equal(ray, vec3(0.0))) * 1e-9);
  vec3 a = -origin * inverse;
  vec3 b = (1.0 - origin) * inverse;
  vec3 low = min(a, b);
  vec3 high = max(a, b);
  return vec2(max(max(low.x, low.y), max(low.z, 0.0)), min(high.x, min(high.y, high.z)));
}

// First meeting with the object between t.x and t.y, -1 if there is none: a linear march, and a
// binary search in the step that went inside (section 21.3).
float march(vec3 origin, vec3 ray, vec2 t, int steps) {
  float size = (t.y - t.x) / float(steps);
  float at = t.x + 0.5 * size;
  for (int n = 0; n < steps; n++) {
    if (inside(origin + at * ray)) {
      float before = max(t.x, at - size);
      for (int k = 0; k < 5; k++) {
        float middle = 0.5 * (before + at);
        if (inside(origin + middle * ray)) at = middle;
        else before = middle;
      }
      return at;
    }
    at += size;
  }
  return -1.0;
}

void write_depth(vec3 metres) {
  vec3 at = v_place.xyz + v_place.w * turn(v_turn, metres);
  vec4 clip = ff_clip(projectionMatrix, modelViewMatrix * vec4(at, 1.0));
  gl_FragDepth = 0.5 * clip.z / clip.w + 0.5;
}

// No more steps than the object has pixels: level of detail comes for free.
int steps_for(vec2 t, vec3 ray) {
  float wanted = clamp(STEPS_PER_PIXEL * v_pixels, 8.0, float(MOST_STEPS));
  return max(4, int(ceil(wanted * (t.y - t.x) * length(ray) / 1.7321)));
}

#ifdef GLASS
// The light that comes along a ray which is bent at every surface, darkened on its way through.
vec3 through(vec3 from, vec3 ray, vec2 t, out vec3 first) {
  float span = 2.0 * length(ff_half);
  float size = span / clamp(v_pixels, 16.0, float(MOST_STEPS));
  vec3 at = from + t.x * ray;
  vec3 way = normalize(ray);
  vec3 mirrored = vec3(0.0);
  float fresnel = 0.0;
  float thickness = 0.0;
  bool within = false;
  int met = 0;
  first = at;
  for (int n = 0; n < 3 * MOST_STEPS; n++) {
    vec3 next = at + size * way;
    vec3 q = to_unit(next);
    bool out_of_box = any(lessThan(q, vec3(0.0))) || any(greaterThan(q, vec3(1.0)));
    if (out_of_box && n > 2) break;
    bool now = !out_of_box && inside(q);
    if (now != within) {
      vec3 low = at;
      vec3 high = next;
      for (int k = 0; k < 5; k++) {
        vec3 middle = 0.5 * (low + high);
        if (inside(to_unit(middle)) == now) high = middle;
        else low = middle;
      }
      if (within) thickness += distance(at, high);
      // The texel's normal is that of the surface; it has to look against the ray.
      vec3 normal = normal_at(to_unit(now ? high : low));
      if (dot(normal, way) > 0.0) normal = -normal;
      if (met == 0) {
        first = high;
        float facing = 1.0 - clamp(-dot(normal, way), 0.0, 1.0);
        fresnel = 0.04 + 0.96 * pow(facing, 5.0);
        mirrored = ff_sky(turn(v_turn, reflect(way, normal)));
      }
      vec3 bent = refract(way, normal, now ? 1.0 / ff_index : ff_index);
      met++;
      if (dot(bent, bent) == 0.0) {
        way = reflect(way, normal); // total reflection: the ray stays inside
        at = low;
        continue;
      }
      way = normalize(bent);
      within = now;
      at = high;
      continue;
    }
    if (within) thickness += size;
    at = next;
  }
  if (met == 0) discard;
  vec3 light = ff_sky(turn(v_turn, way)) * exp(-ff_absorb * thickness);
  return mix(light, mirrored, fresnel);
}
#endif

void main() {
#ifdef FADE
  if (ff_faded()) discard;
#endif
  vec3 origin = to_unit(v_eye);
  vec3 ray = to_unit(v_point) - origin;
  vec2 t = cross_box(origin, ray);
  if (t.y <= t.x) discard;
#if defined(GLASS)
  vec3 first;
  color = vec4(ff_to_srgb(through(v_eye, v_point - v_eye, t, first)), 1.0);
  write_depth(first);
#elif defined(TRANSLUCENT)
  // The length of the ray within every slab, step by step, heights taken as linear in between.
  int steps = steps_for(t, ray);
  float size = (t.y - t.x) / float(steps);
  float metres = length(v_point - v_eye);
  float thickness = 0.0;
  float nearest = -1.0;
  float before = depth_in(origin + t.x * ray);
  for (int n = 1; n <= steps; n++) {
    float after = depth_in(origin + (t.x + float(n) * size) * ray);
    float share = before >= 0.0 && after >= 0.0 ? 1.0
      : before < 0.0 && after < 0.0 ? 0.0 : 0.5;
    if (share > 0.0 && nearest < 0.0) nearest = t.x + float(n) * size;
    thickness += share * size * metres;
    before = after;
  }
  if (nearest < 0.0) discard;
  vec3 q = origin + nearest * ray;
  vec3 base = to_linear(texelFetch(ff_fields, ivec3(texel_of(q), surface_of(q)), 0).rgb);
  vec3 lit = ff_shade(base, turn(v_turn, normal_at(q)), vec3(0.0), 0.0);
  float alpha = 1.0 - exp(-ff_absorb.g * thickness);
  color = vec4(alpha * ff_to_srgb(lit), alpha);
  write_depth(mix(v_eye, v_point, nearest));
#else
  float at = march(origin, ray, t, steps_for(t, ray));
  if (at < 0.0) discard;
  vec3 q = origin + at * ray;
  int layer = surface_of(q);
  vec3 base = to_linear(texelFetch(ff_fields, ivec3(texel_of(q), layer), 0).rgb);
  vec3 n = turn(v_turn, normal_at(q));
  vec3 lit = ff_shade(base, n, vec3(0.0), 0.0);
#ifdef SHADOW
  // A second ray, towards the sun, from just above the surface.
  vec3 sun = ff_axes * (turn(vec4(-v_turn.xyz, v_turn.w), ff_sun_direction) / (2.0 * ff_half));
  sun /= length(sun);
  vec3 from = q + 0.03 * sun;
  vec2 s = cross_box(from, sun);
  if (s.y > s.x && march(from, sun, s, 20) >= 0.0) {
    lit -= base * ff_sun * max(dot(n, ff_sun_direction), 0.0);
  }
#endif
#ifdef REFLECT
  vec3 seen = turn(v_turn, normalize(v_point - v_eye));
  lit = mix(lit, ff_sky(reflect(seen, n)), REFLECT);
#endif
  color = vec4(ff_to_srgb(clamp(lit, 0.0, 1.0)), 1.0);
  write_depth(mix(v_eye, v_point, at));
#endif
}
`;
