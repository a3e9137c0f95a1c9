// Reads a list of numbers by addresses, computes with 64-bit integers and floats, and writes what the host knows.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_buffer_reference_uvec2 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require

layout(local_size_x = 32) in;

struct Answer {
  uint64_t integer;
  double real;
  float single;
  uint index;
};

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Numbers {
  uint64_t values[];
};
layout(buffer_reference, scalar, buffer_reference_align = 8) writeonly buffer Answers {
  Answer values[];
};
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Table {
  uint64_t numbers;
  uint64_t answers;
  vec3 weights;  // 12 bytes, so that `count` shows the scalar layout
  uint count;
};

layout(push_constant, scalar) uniform Push {
  uint64_t table;
};

// splitmix64
uint64_t mixed(uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ul;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebul;
  return z ^ (z >> 31);
}

void main() {
  Table numbers_of = Table(table);
  const uint i = gl_GlobalInvocationID.x;
  if (i >= numbers_of.count) return;
  const uint64_t number = Numbers(numbers_of.numbers).values[i];
  Answer answer;
  answer.integer = mixed(number);
  answer.real = double(number & 0xfffffful) / 3.0 + sqrt(double(i) + 2.0);
  answer.single = dot(numbers_of.weights, vec3(1, float(i), float(i * i)));
  answer.index = i;
  Answers(numbers_of.answers).values[i] = answer;
}
