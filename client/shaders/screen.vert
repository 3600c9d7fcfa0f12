#version 300 es
// One triangle over the whole picture; no vertex data.
out vec2 uv;

void main() {
  uv = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
  gl_Position = vec4(uv * 2.0 - 1.0, 0.9999, 1.0);
}
