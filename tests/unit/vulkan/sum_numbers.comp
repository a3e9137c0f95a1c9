// answer = the sum of `count` numbers, and for the test of the time limit as many rounds of a hash as `rounds` says.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require

layout(local_size_x = 1) in;

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Numbers {
  uint values[];
};
layout(buffer_reference, scalar, buffer_reference_align = 8) writeonly buffer Answer {
  uint64_t sum;
};

layout(push_constant, scalar) uniform Push {
  uint64_t numbers, answer;
  uint count, rounds;
};

void main() {
  uint64_t sum = 0;
  for (uint i = 0; i < count; ++i) sum += Numbers(numbers).values[i];
  uint hash = uint(sum);
  for (uint i = 0; i < rounds; ++i) hash = (hash ^ (hash >> 15)) * 0x2c1b3c6du + i;
  Answer(answer).sum = rounds == 0u ? sum : uint64_t(hash);
}
