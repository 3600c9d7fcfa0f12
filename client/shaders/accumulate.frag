#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler3D;

// Adds a picture to the average of those before it, pixel by pixel. Each picture is drawn with its samples a little
// aside (`jitter`) and with other random numbers for its coverage, so that the average has many samples for each pixel.
// What moves is looked up where it was before: the camera's motion follows from the depth; inside a character's ball,
// hair moves with its head and with its lattices.
in vec2 uv;
uniform sampler2D current;  // colours in the display's encoding, alpha premultiplied
uniform sampler2D depth;
uniform sampler2D history;
uniform sampler2D history_count;  // pictures in the average
uniform vec2 jitter;              // of `current`, uv
uniform mat4 to_scene;            // clip space of `current`, with its jitter -> scene, the camera as origin
uniform mat4 to_clip_before;      // from there to clip space of the picture before, without jitter

const int kMovingMax = 8;
uniform int moving_count;
uniform mat4 to_head[kMovingMax];           // scene -> head space, m
uniform mat4 head_to_clip_before[kMovingMax];
uniform float radius_m[kMovingMax];         // of the ball, head space
uniform sampler3D swing;                    // per character kSwingNodes slices: where hair was, minus where it is, m
const float kSwingNodes = 8.0;

layout(location = 0) out vec4 colour;
layout(location = 1) out vec4 count;

const float kStillMax = 32.0, kMovingMost = 6.0;  // pictures in the average: each lookup in motion blurs a little

vec2 uv_of(vec4 clip) { return 0.5 * clip.xy / clip.w + 0.5; }

// The nearest surface around the pixel: hair is thin, and its motion counts where it covers a part of the pixel.
vec3 nearest_surface() {
  vec2 texel = 1.0 / vec2(textureSize(depth, 0));
  vec3 best = vec3(uv, 2.0);
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      vec2 at = uv + vec2(x, y) * texel;
      float d = texture(depth, at).x;
      if (d < best.z) best = vec3(at, d);
    }
  }
  return best;
}

// Where the surface was in the picture before, uv.
vec2 before_of(vec3 surface) {
  vec4 from = to_scene * vec4(2.0 * surface - 1.0, 1.0);
  vec3 scene = from.xyz / from.w;
  float nearest = 1.0;
  vec4 clip = to_clip_before * vec4(scene, 1.0);
  for (int n = 0; n < moving_count; ++n) {
    vec3 head = (to_head[n] * vec4(scene, 1.0)).xyz;
    float away = length(head) / radius_m[n];
    if (away >= nearest) continue;
    nearest = away;
    vec3 node = (0.5 + 0.5 * head / radius_m[n]) * (kSwingNodes - 1.0) + 0.5;
    vec3 at = vec3(node.xy, node.z + kSwingNodes * float(n)) / vec3(textureSize(swing, 0));
    clip = head_to_clip_before[n] * vec4(head + texture(swing, at).xyz, 1.0);
  }
  return clip.w > 0.0 ? uv_of(clip) : vec2(-1.0);
}

// Catmull-Rom with five bilinear lookups (Jimenez): bilinear alone would blur moving hair more with every picture.
vec4 sharp(vec2 at) {
  vec2 size = vec2(textureSize(history, 0)), p = at * size, centre = floor(p - 0.5) + 0.5, f = p - centre;
  vec2 w0 = f * (-0.5 + f * (1.0 - 0.5 * f)), w3 = f * f * (-0.5 + 0.5 * f);
  vec2 w1 = 1.0 + f * f * (-2.5 + 1.5 * f), w12 = 1.0 - w0 - w3, w2 = w12 - w1;
  vec2 low = (centre - 1.0) / size, middle = (centre + w2 / w12) / size, high = (centre + 2.0) / size;
  vec4 sum = texture(history, middle) * w12.x * w12.y + texture(history, vec2(low.x, middle.y)) * w0.x * w12.y +
             texture(history, vec2(high.x, middle.y)) * w3.x * w12.y +
             texture(history, vec2(middle.x, low.y)) * w12.x * w0.y +
             texture(history, vec2(middle.x, high.y)) * w12.x * w3.y;
  return sum / (w12.x * w12.y + (w0.x + w3.x) * w12.y + w12.x * (w0.y + w3.y));
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(current, 0) - 1;
  vec4 fresh = texelFetch(current, pixel, 0);
  colour = fresh;
  count = vec4(1.0);
  vec3 surface = nearest_surface();
  vec2 motion = before_of(surface) - (surface.xy - jitter), at = uv + motion;
  if (!(all(greaterThan(at, vec2(0.0))) && all(lessThan(at, vec2(1.0))))) return;
  float pictures = texture(history_count, at).x;
  if (!(pictures > 0.0)) return;

  float moved_px = length(motion * vec2(last + 1));
  bool still = moved_px < 0.01;
  vec4 average = still ? texelFetch(history, pixel, 0) : clamp(sharp(at), 0.0, 1.0);

  // What the neighbourhood does not show any more is no part of the average: it would be a ghost.
  vec4 sum = vec4(0.0), squares = vec4(0.0);
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      vec4 c = texelFetch(current, clamp(pixel + ivec2(x, y), ivec2(0), last), 0);
      sum += c;
      squares += c * c;
    }
  }
  vec4 mean = sum / 9.0, spread = sqrt(max(squares / 9.0 - mean * mean, 0.0));
  spread = mix(2.5, 1.25, smoothstep(0.0, 0.5, moved_px)) * spread + 1.5 / 255.0;
  vec4 away = abs(average - mean) / spread;
  float outside = max(max(away.x, away.y), max(away.z, away.w));
  if (outside > 1.0) {
    average = mean + (average - mean) / outside;
    pictures = max(pictures / outside, 1.0);
  }
  float most = mix(kStillMax, kMovingMost, smoothstep(0.0, 0.5, moved_px));
  pictures = min(pictures + 1.0, most);
  colour = mix(average, fresh, 1.0 / pictures);
  count = vec4(pictures);
}
