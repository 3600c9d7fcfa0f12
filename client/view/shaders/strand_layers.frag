in float cover;
out vec4 layers;

void main() {
  float first = texelFetch(hair_first_depth, ivec2(gl_FragCoord.xy), 0).r;
  float behind = (gl_FragCoord.z - first) * light_map.x;
  layers = step(vec4(behind), layer_depth) * (cover / light_map.w);
}
