// glTF and GLB files, from bytes to a scene that rays can be traced in.
#include "tests/fuzz/fuzz_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto source = helio::make_memory_source({{"fuzz.gltf", {data, data + size}}});
  helio::fuzz::load_and_build(*source, "fuzz.gltf");
  return 0;
}
