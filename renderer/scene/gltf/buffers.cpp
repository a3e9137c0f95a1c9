#include "renderer/scene/gltf/buffers.h"

#include "renderer/scene/gltf/document/uri.h"
#include "renderer/scene/gltf/meshopt.h"

namespace helio::gltf {

Result<std::vector<std::uint8_t>> read_other_file(const FileSource& source, const std::string& scene_file,
                                                  const std::string& uri, MemoryBudget& budget) {
  if (has_scheme(uri))
    return Error{ErrorCode::permission_denied, uri.substr(0, 80) + " is not a relative URI and is not read", {}};
  Result<std::string> path = resolve_uri(scene_file, uri);
  if (!path.ok()) return path.error();
  // A file's own bytes raise the allowance, so the configured maximum is what bounds reading it.
  Result<std::vector<std::uint8_t>> bytes = source.read(*path, budget.remaining_configured());
  if (!bytes.ok()) return bytes.error();
  budget.add_source_file(*path, bytes->size());
  if (Status s = budget.reserve(bytes->size(), ""); !s.ok()) return s.error();
  return bytes;
}

BufferStore::BufferStore(const Document& document, const Container& container, const FileSource& source,
                         const std::string& scene_file, MemoryBudget& budget, Diagnostics& diagnostics) {
  std::vector<bool> used(document.buffers.size());
  for (const BufferView& view : document.views) {
    used[std::size_t(view.buffer)] = true;
    if (view.meshopt) used[std::size_t(view.meshopt->buffer)] = true;
  }
  buffers_.resize(document.buffers.size());
  for (std::size_t i = 0; i < buffers_.size(); ++i)
    load(i, document.buffers[i], container, source, scene_file, budget, diagnostics, used[i]);
  if (diagnostics.failed()) return;

  views_.resize(document.views.size());
  decoded_.resize(document.views.size());
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const BufferView& view = document.views[i];
    if (view.meshopt) {
      decode(i, *view.meshopt, budget, diagnostics);
    } else if (const Bytes& buffer = buffers_[std::size_t(view.buffer)]; !buffer.bytes.empty()) {
      views_[i] = buffer.bytes.subspan(view.byte_offset, view.byte_length);
    }
  }
}

void BufferStore::load(std::size_t index, const Buffer& buffer, const Container& container, const FileSource& source,
                       const std::string& scene_file, MemoryBudget& budget, Diagnostics& diagnostics, bool used) {
  const std::string place = std::string() / "buffers" / index;
  Bytes& target = buffers_[index];
  if (!buffer.uri) {
    if (container.is_glb && index == 0 && container.bin) {
      target.bytes = *container.bin;
    } else if (container.is_glb && index == 0 && !buffer.is_fallback) {
      diagnostics.fail(place, "refers to the GLB's binary chunk, which is missing");
      return;
    } else {
      return;  // nothing behind it: an error only where it is read
    }
  } else if (is_data_uri(*buffer.uri)) {
    Result<DataUri> data = decode_data_uri(*buffer.uri, budget);
    if (!data.ok()) return diagnostics.fail(place / "uri", data.error());
    if (!data->media_type.empty() && data->media_type != "application/octet-stream" &&
        data->media_type != "application/gltf-buffer")
      diagnostics.tolerate(place / "uri", "has media type \"" + data->media_type.substr(0, 60) +
                                              "\", allowed: application/octet-stream, application/gltf-buffer",
                           "its bytes are read all the same");
    target.owned = std::move(data->bytes);
    target.bytes = target.owned;
  } else if (has_scheme(*buffer.uri) && !buffer.uri->starts_with(':') && !used) {
    diagnostics.warn(place / "uri", "is not a relative URI; the buffer is not used and not read");
    return;
  } else {
    Result<std::vector<std::uint8_t>> bytes = read_other_file(source, scene_file, *buffer.uri, budget);
    if (!bytes.ok()) return diagnostics.fail(place / "uri", bytes.error());
    target.owned = std::move(*bytes);
    target.bytes = target.owned;
  }
  if (target.bytes.size() < buffer.byte_length)
    diagnostics.fail(place, "byteLength is " + std::to_string(buffer.byte_length) + ", but there are only " +
                                std::to_string(target.bytes.size()) + " bytes");
}

void BufferStore::decode(std::size_t index, const MeshoptView& view, MemoryBudget& budget, Diagnostics& diagnostics) {
  const std::string place = std::string() / "bufferViews" / index / "extensions" / "EXT_meshopt_compression";
  const Bytes& buffer = buffers_[std::size_t(view.buffer)];
  if (buffer.bytes.empty()) return diagnostics.fail(place, "its buffer has no data");
  if (Status s = budget.reserve(view.count, view.byte_stride, ""); !s.ok()) return diagnostics.fail(place, s.error());
  Result<std::vector<std::uint8_t>> bytes =
      decode_meshopt(view, buffer.bytes.subspan(view.byte_offset, view.byte_length));
  if (!bytes.ok()) return diagnostics.fail(place, bytes.error());
  decoded_[index] = std::move(*bytes);
  views_[index] = decoded_[index];
}

}  // namespace helio::gltf
