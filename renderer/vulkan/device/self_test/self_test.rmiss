#version 460
#extension GL_EXT_ray_tracing : require

struct Answer {
  int triangle;
  float distance;
  uint occluded;
  uint seen;
};

layout(location = 0) rayPayloadInEXT Answer answer;

void main() {
  answer.triangle = -1;
  answer.occluded = 0;
}
