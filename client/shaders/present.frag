#version 300 es
precision highp float;
precision highp sampler2D;

// Copies the average of pictures (accumulate.frag) to the screen.
uniform sampler2D average;
out vec4 colour;

void main() { colour = texelFetch(average, ivec2(gl_FragCoord.xy), 0); }
