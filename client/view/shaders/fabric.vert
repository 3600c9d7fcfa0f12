// Cloth, strips of hair and threads.
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal;
layout(location = 2) in vec4 fibre;   // along the hair; zero on cloth and threads
layout(location = 3) in vec4 light;   // light left of: ambient, fill, rim
layout(location = 4) in vec4 colour;  // albedo, opacity
layout(location = 5) in vec3 place;   // on a strip: across, along; and a number of its own

out vec3 position_world;
out vec3 normal_world;
out vec3 fibre_world;
out vec3 light_left;
out vec4 albedo_opacity;
out vec3 place_on_strip;

void main() {
  gl_Position = view_projection * vec4(position, 1.0);
  position_world = position;
  normal_world = normal.xyz;
  fibre_world = fibre.xyz;
  light_left = light.xyz;
  albedo_opacity = colour;
  place_on_strip = place;
}
