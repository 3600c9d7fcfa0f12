layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal;
layout(location = 2) in vec4 around;  // light left of: ambient, fill, rim; nearness of hair roots

out vec3 position_world;
out vec3 normal_world;
out vec4 surroundings;

void main() {
  gl_Position = view_projection * vec4(position, 1.0);
  position_world = position;
  normal_world = normal.xyz;
  surroundings = around;
}
