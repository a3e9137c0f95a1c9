// Mitsuba scenes and the meshes that they name: the XML up to the first zero byte, behind it the bytes of mesh.obj,
// mesh.ply and mesh.serialized alike.
#include <algorithm>

#include "tests/fuzz/fuzz_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::uint8_t* const end = data + size;
  const std::uint8_t* const zero = std::find(data, end, std::uint8_t(0));
  const std::vector<std::uint8_t> mesh(zero == end ? end : zero + 1, end);
  const auto source = helio::make_memory_source(
      {{"fuzz.xml", {data, zero}}, {"mesh.obj", mesh}, {"mesh.ply", mesh}, {"mesh.serialized", mesh}});
  helio::fuzz::load_and_build(*source, "fuzz.xml", "mesh.");
  return 0;
}
