// Counts the rounds of a loop that should have `rounds`.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require

layout(local_size_x = 1) in;

layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Answer {
  uint counted;
  uint hash;  // so that the loop is not computed away
};

layout(push_constant, scalar) uniform Push {
  uint64_t answer;
  uint rounds;
};

void main() {
  uint counted = 0, hash = rounds;
  while (counted < rounds && hash != 0x2c1b3c6du) {
    hash = (hash ^ (hash >> 15)) * 0x297a2d39u + counted;
    ++counted;
  }
  Answer(answer).counted = counted;
  Answer(answer).hash = hash;
}
