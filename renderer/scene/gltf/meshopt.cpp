#include "renderer/scene/gltf/meshopt.h"

#include <meshoptimizer.h>

namespace helio::gltf {

Result<std::vector<std::uint8_t>> decode_meshopt(const MeshoptView& view, std::span<const std::uint8_t> compressed) {
  const std::size_t count = view.count, stride = view.byte_stride;
  std::vector<std::uint8_t> bytes(count * stride);
  int status = 0;
  switch (view.mode) {
    case MeshoptMode::attributes:
      status = meshopt_decodeVertexBuffer(bytes.data(), count, stride, compressed.data(), compressed.size());
      break;
    case MeshoptMode::triangles:
      status = meshopt_decodeIndexBuffer(bytes.data(), count, stride, compressed.data(), compressed.size());
      break;
    case MeshoptMode::indices:
      status = meshopt_decodeIndexSequence(bytes.data(), count, stride, compressed.data(), compressed.size());
      break;
  }
  if (status != 0)
    return Error{ErrorCode::invalid_argument,
                 "the meshopt-compressed data is broken (decoder status " + std::to_string(status) + ")",
                 {}};
  switch (view.filter) {
    case MeshoptFilter::none:
      break;
    case MeshoptFilter::octahedral:
      meshopt_decodeFilterOct(bytes.data(), count, stride);
      break;
    case MeshoptFilter::quaternion:
      meshopt_decodeFilterQuat(bytes.data(), count, stride);
      break;
    case MeshoptFilter::exponential:
      meshopt_decodeFilterExp(bytes.data(), count, stride);
      break;
  }
  return bytes;
}

}  // namespace helio::gltf
