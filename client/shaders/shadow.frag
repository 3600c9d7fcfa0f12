#include "scene.glsl"

// Depth alone, for shadow maps: a share of the texels, random but fixed, is as large as the coverage.
#ifdef STRAND
in vec4 shade;
in vec3 across;
#endif
#ifdef CARD
in vec4 place;
uniform sampler2D card_texture;
#endif
#ifdef FABRIC
in vec4 albedo_opacity;
#endif

out vec4 colour;

float chance_at_texel(float number) {
  uint seed = uint(gl_FragCoord.x) * 1597334677u ^ uint(gl_FragCoord.y) * 3812015801u ^ floatBitsToUint(number);
  return float(scramble(seed) >> 8u) / 16777216.0;
}

void main() {
  float cover = 1.0, number = 0.0;
#ifdef STRAND
  cover = shade.a * clamp(across.y + 0.5 - abs(across.x), 0.0, 1.0);
  number = across.z;
#endif
#ifdef CARD
  float column = mod(floor(place.z + 0.5), 4.0) + mix(0.004, 0.996, place.x);
  cover = texture(card_texture, vec2(column / 4.0, place.y)).a * place.w;
  number = place.z;
#endif
#ifdef FABRIC
  cover = albedo_opacity.a;
#endif
  if (cover <= chance_at_texel(number)) discard;
  colour = vec4(1.0);
}
