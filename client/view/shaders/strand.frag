in vec4 shade;
in vec2 across;
out vec4 colour;

void main() {
  float cover = clamp(across.y + 0.5 - abs(across.x), 0.0, 1.0);
  colour = vec4(shade.rgb, 0.96 * cover * shade.a);
}
