#include "renderer/scene/gltf/images.h"

#include "renderer/scene/gltf/document/uri.h"
#include "renderer/scene/images/image_decoder.h"
#include "renderer/scene/images/image_probe.h"

namespace helio::gltf {

namespace {

struct Encoded {
  std::span<const std::uint8_t> bytes;
  std::vector<std::uint8_t> owned;
  std::string media_type;  // as declared; empty when not
};

const char* media_type_of(ImageFormat format) {
  switch (format) {
    case ImageFormat::png:
      return "image/png";
    case ImageFormat::jpeg:
      return "image/jpeg";
    case ImageFormat::webp:
      return "image/webp";
    default:
      return "";
  }
}

// A PNG is a signature and chunks up to IEND (PNG specification, 5.3); an image that is not decoded must still be
// whole.
bool is_whole_png(std::span<const std::uint8_t> bytes) {
  std::size_t at = 8;
  while (bytes.size() >= 12 && at <= bytes.size() - 12) {
    const std::size_t length = std::size_t(bytes[at]) << 24 | std::size_t(bytes[at + 1]) << 16 |
                               std::size_t(bytes[at + 2]) << 8 | bytes[at + 3];
    if (length > bytes.size() - 12 - at) return false;
    if (bytes[at + 4] == 'I' && bytes[at + 5] == 'E' && bytes[at + 6] == 'N' && bytes[at + 7] == 'D') return true;
    at += 12 + length;
  }
  return false;
}

class ImageLoader {
 public:
  ImageLoader(const Document& document, const BufferStore& buffers, const FileSource& source,
              const std::string& scene_file, MemoryBudget& budget, Diagnostics& diagnostics)
      : document_(document),
        buffers_(buffers),
        source_(source),
        scene_file_(scene_file),
        budget_(budget),
        diagnostics_(diagnostics) {}

  // The decoded image when `decode`; nothing when only checked, or after a failure.
  std::optional<Image> load(std::size_t index, bool decode) {
    const ImageSource& image = document_.images[index];
    const std::string place = std::string() / "images" / index;
    const std::uint64_t used_before = budget_.used();
    std::optional<Encoded> encoded = fetch(image, place, decode);
    std::optional<Image> result;
    if (encoded) looked_at_ += encoded->bytes.size();
    if (looked_at_ > budget_.limit()) {  // many images over the same bytes, or one file named again and again
      diagnostics_.fail(
          place,
          "images have been read for " + std::to_string(looked_at_) + " bytes in all, out of proportion to the file",
          ErrorCode::resource_exhausted);
      return std::nullopt;
    }
    if (encoded && check_format(*encoded, place, decode) && decode) {
      Result<Image> decoded = decode_image(encoded->bytes, image.name, budget_.remaining(), nullptr,
                                           [&](std::uint64_t bytes) { return budget_.reserve(bytes, ""); });
      if (decoded.ok())
        result = std::move(*decoded);
      else
        diagnostics_.fail(place, decoded.error());
    }
    budget_.release(budget_.used() - used_before - (result ? result->bytes() : 0));  // the encoded bytes
    return result;
  }

 private:
  std::optional<Encoded> fetch(const ImageSource& image, const std::string& place, bool decode) {
    Encoded encoded;
    encoded.media_type = image.mime_type;
    if (image.view >= 0) {
      encoded.bytes = buffers_.view(image.view);
      if (encoded.bytes.empty()) {
        diagnostics_.fail(place / "bufferView", "has no data: its buffer has no URI");
        return std::nullopt;
      }
      return encoded;
    }
    if (is_data_uri(*image.uri)) {
      Result<DataUri> data = decode_data_uri(*image.uri, budget_);
      if (!data.ok()) {
        diagnostics_.fail(place / "uri", data.error());
        return std::nullopt;
      }
      if (encoded.media_type.empty()) encoded.media_type = data->media_type;
      encoded.owned = std::move(data->bytes);
    } else if (has_scheme(*image.uri) && !image.uri->starts_with(':') && !decode) {
      diagnostics_.warn(place / "uri", "is not a relative URI; the image is not used and not read");
      return std::nullopt;
    } else {
      Result<std::vector<std::uint8_t>> bytes = read_other_file(source_, scene_file_, *image.uri, budget_);
      if (!bytes.ok()) {
        diagnostics_.fail(place / "uri", bytes.error());
        return std::nullopt;
      }
      encoded.owned = std::move(*bytes);
    }
    encoded.bytes = encoded.owned;
    return encoded;
  }

  bool check_format(const Encoded& encoded, const std::string& place, bool decode) {
    const ImageProbe probe = probe_image(encoded.bytes);
    const std::string actual = media_type_of(probe.format);
    if (actual.empty() && decode) {
      diagnostics_.fail(place, "is neither PNG nor JPEG", ErrorCode::unimplemented);
    } else if (actual.empty()) {
      diagnostics_.warn(place, "is neither PNG nor JPEG, and not used");
      return false;
    } else if (probe.format == ImageFormat::webp && !document_.extensions.used("EXT_texture_webp")) {
      diagnostics_.fail(place, "is image/webp, which needs the extension EXT_texture_webp");
    } else if (probe.format == ImageFormat::webp && decode) {
      diagnostics_.fail(place, "is image/webp, which is not supported", ErrorCode::unimplemented);
    } else if (probe.format == ImageFormat::png && !is_whole_png(encoded.bytes)) {
      diagnostics_.fail(place, "is a PNG that ends early");
    } else {
      if (!encoded.media_type.empty() && encoded.media_type != actual)
        diagnostics_.tolerate(place, "is " + actual + ", but is declared as " + encoded.media_type.substr(0, 60),
                              "read as " + actual);
      return true;
    }
    return false;
  }

  const Document& document_;
  const BufferStore& buffers_;
  const FileSource& source_;
  const std::string& scene_file_;
  MemoryBudget& budget_;
  Diagnostics& diagnostics_;
  std::uint64_t looked_at_ = 0;
};

}  // namespace

LoadedImages load_images(const Document& document, const std::vector<bool>& needed, const BufferStore& buffers,
                         const FileSource& source, const std::string& scene_file, MemoryBudget& budget,
                         Diagnostics& diagnostics) {
  LoadedImages result;
  result.index.assign(document.images.size(), -1);
  ImageLoader loader(document, buffers, source, scene_file, budget, diagnostics);
  for (std::size_t i = 0; i < document.images.size() && !diagnostics.crowded(); ++i) {
    std::optional<Image> image = loader.load(i, needed[i]);
    if (!image) continue;
    result.index[i] = int(result.images.size());
    result.images.push_back(std::move(*image));
  }
  return result;
}

}  // namespace helio::gltf
