#include "renderer/scene/image_decoder.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <new>

#include "renderer/scene/image_probe.h"
#include "renderer/scene/png_check.h"

namespace helio {
namespace {

const char* reader_name(ImageFormat format) {
  switch (format) {
    case ImageFormat::png:
      return "png";
    case ImageFormat::jpeg:
      return "jpeg";
    case ImageFormat::exr:
      return "openexr";
    case ImageFormat::hdr:
      return "hdr";
    case ImageFormat::pnm:
      return "pnm";
    case ImageFormat::webp:
      return "webp";
    case ImageFormat::unknown:
      break;
  }
  return "";
}

Error broken(const std::string& name, std::string message) {
  std::replace(message.begin(), message.end(), '\n', ' ');
  return Error{ErrorCode::invalid_argument, std::move(message), name};
}

// Everything that runs in parallel runs in our own arena: the libraries' pools stay empty.
void disable_library_threads() {
  static std::once_flag once;
  std::call_once(once, [] {
    OIIO::attribute("threads", 1);
    OIIO::attribute("exr_threads", 1);  // 1: OpenEXR's pool gets no thread; 0 would mean one per core
  });
}

// Refuses sizes before anything is allocated by them.
Status check_size(const std::string& name, std::int64_t width, std::int64_t height, double bits_per_pixel,
                  double max_ratio, std::size_t file_bytes) {
  if (width < 1 || height < 1) {
    return broken(name, fmt::format("image size {}x{} (allowed: 1 to {} a side)", width, height, kMaxImageSide));
  }
  if (width > kMaxImageSide || height > kMaxImageSide) {
    return Error{ErrorCode::resource_exhausted,
                 fmt::format("image size {}x{} exceeds the limit of {} pixels a side", width, height, kMaxImageSide),
                 name};
  }
  const double most = 4096 + max_ratio * double(file_bytes);
  if (max_ratio > 0 && bits_per_pixel / 8 * double(width) * double(height) > most) {
    return broken(
        name, fmt::format("image claims {}x{} pixels, more than {} bytes of file can hold", width, height, file_bytes));
  }
  return ok_status();
}

// The bytes of the file, then zeros: OpenImageIO 2.4 leaks when a read fails inside libpng, whereas libpng itself
// recognises that no chunk can be all zeros.
class PaddedReader : public OIIO::Filesystem::IOMemReader {
 public:
  explicit PaddedReader(std::span<const std::uint8_t> bytes)
      : IOMemReader(const_cast<std::uint8_t*>(bytes.data()), bytes.size()) {}

  std::size_t read(void* buffer, std::size_t size) override {
    const std::size_t got = IOMemReader::read(buffer, size);
    if (got < size) {
      past_end_ = true;
      std::memset(static_cast<char*>(buffer) + got, 0, size - got);
    }
    return size;
  }
  bool past_end() const { return past_end_; }

 private:
  bool past_end_ = false;
};

struct Layout {
  int first_channel = 0, channels = 0;
  TexelFormat format = TexelFormat::u8;
  OIIO::TypeDesc type;
};

// The channels to take: all of an ordinary image; of an EXR the first run of colour channels (OpenImageIO sorts each
// layer to R, G, B, A).
Result<Layout> choose_layout(const OIIO::ImageSpec& spec, ImageFormat format, const std::string& name) {
  Layout layout;
  layout.channels = std::min(spec.nchannels, 4);
  if (format == ImageFormat::exr) {
    const auto suffix = [&](int channel) {
      const std::string& full = spec.channelnames[std::size_t(channel)];
      const std::size_t dot = full.rfind('.');
      return dot == std::string::npos ? full : full.substr(dot + 1);
    };
    // OpenImageIO 2.4 hands chroma out as colour when it is not subsampled; 2.5 converts to R, G, B, but reads some
    // of these images as black.
    bool luminance_chroma = spec.get_int_attribute("openexr:luminancechroma") != 0;
    for (int channel = 0; channel < spec.nchannels; ++channel) {
      luminance_chroma = luminance_chroma || suffix(channel) == "RY" || suffix(channel) == "BY";
    }
    if (luminance_chroma) {
      return broken(name, "luminance-chroma EXR images, subsampled or not (allowed: R, G, B, A, or Y alone)");
    }
    const auto is_run = [&](int first, std::initializer_list<const char*> names) {
      int channel = first;
      for (const char* wanted : names) {
        if (channel >= spec.nchannels || suffix(channel) != wanted) return false;
        ++channel;
      }
      return true;
    };
    int count = 0, first = 0;
    for (first = 0; first < spec.nchannels && count == 0; ++first) {
      if (is_run(first, {"R", "G", "B", "A"}))
        count = 4;
      else if (is_run(first, {"R", "G", "B"}))
        count = 3;
      else if (is_run(first, {"Y", "A"}))
        count = 2;
      else if (is_run(first, {"Y"}))
        count = 1;
      if (count) break;
    }
    if (count == 0 && spec.nchannels > 1) {
      return broken(name, fmt::format("no colour channels among {} (allowed: R, G, B, A or Y, or a single channel)",
                                      fmt::join(spec.channelnames, ", ")));
    }
    layout.first_channel = count ? first : 0;
    layout.channels = count ? count : 1;
  }
  int widest = 0;
  for (int channel = layout.first_channel; channel < layout.first_channel + layout.channels; ++channel) {
    switch (spec.channelformat(channel).basetype) {
      case OIIO::TypeDesc::UINT8:
        widest = std::max(widest, 0);
        break;
      case OIIO::TypeDesc::UINT16:
        widest = std::max(widest, 1);
        break;
      case OIIO::TypeDesc::HALF:
        widest = std::max(widest, 2);
        break;
      case OIIO::TypeDesc::FLOAT:
        widest = std::max(widest, 3);
        break;
      default:
        return Error{
            ErrorCode::unimplemented,
            fmt::format("texels of type {} (allowed: uint8, uint16, half, float)", spec.channelformat(channel).c_str()),
            name};
    }
  }
  constexpr OIIO::TypeDesc::BASETYPE kTypes[] = {OIIO::TypeDesc::UINT8, OIIO::TypeDesc::UINT16, OIIO::TypeDesc::HALF,
                                                 OIIO::TypeDesc::FLOAT};
  layout.format = TexelFormat(widest);
  layout.type = OIIO::TypeDesc(kTypes[widest]);
  return layout;
}

Result<Image> decode(std::span<const std::uint8_t> bytes, const std::string& name, std::uint64_t max_bytes,
                     const ReserveBytes& reserve) {
  const ImageProbe probe = probe_image(bytes);
  if (probe.format == ImageFormat::unknown) {
    return Error{ErrorCode::unimplemented, "image format is not known (allowed: PNG, JPEG, OpenEXR, HDR, PNM, WebP)",
                 name};
  }
  if (probe.deep) return broken(name, "deep EXR images hold no single colour per pixel (allowed: flat images)");
  const bool size_in_text = probe.format == ImageFormat::hdr || probe.format == ImageFormat::pnm;
  if (!size_in_text) {
    if (probe.apple_png) return broken(name, "Apple's CgBI variant of PNG (allowed: PNG as standardised)");
    if (probe.width < 0) return broken(name, fmt::format("{} header is broken or cut off", reader_name(probe.format)));
    if (probe.cut_off) return broken(name, "JPEG data is cut off: no end-of-image marker");
    const Status fits =
        check_size(name, probe.width, probe.height, probe.bits_per_pixel, probe.max_ratio, bytes.size());
    if (!fits) return fits.error();
  }

  if (probe.format == ImageFormat::png) {
    if (std::string fault = find_png_fault(bytes); !fault.empty()) return broken(name, std::move(fault));
  }

  disable_library_threads();
  const std::unique_ptr<OIIO::ImageInput> in = OIIO::ImageInput::create(reader_name(probe.format));
  if (!in || !in->supports("ioproxy")) {
    OIIO::geterror();
    return Error{ErrorCode::unimplemented,
                 fmt::format("the installed OpenImageIO cannot read {} from memory", reader_name(probe.format)), name};
  }
  OIIO::Filesystem::IOMemReader plain(const_cast<std::uint8_t*>(bytes.data()), bytes.size());
  PaddedReader padded(bytes);
  OIIO::Filesystem::IOMemReader& memory = probe.format == ImageFormat::png ? padded : plain;
  OIIO::ImageSpec hints, spec;
  hints.attribute("oiio:UnassociatedAlpha", 1);
  hints.attribute("oiio:reorient", 0);
  const auto failure = [&] {
    const std::string said = in->geterror();
    return broken(name, padded.past_end() ? "PNG data is cut off" : said.empty() ? "image cannot be decoded" : said);
  };
  if (!in->set_ioproxy(&memory) || !in->open("image", spec, hints)) return failure();

  // The probe saw the claim that decoders act on first; this is the one that the pixels will have.
  if (spec.depth > 1) return broken(name, fmt::format("image is a volume of depth {} (allowed: 1)", spec.depth));
  if (spec.nchannels < 1) return broken(name, "image has no channels");
  const double bits = probe.bits_per_pixel > 0 ? probe.bits_per_pixel
                      : probe.format == ImageFormat::pnm
                          ? spec.nchannels * (spec.get_int_attribute("oiio:BitsPerSample", 8) == 1 ? 1 : 8)
                          : 32;
  const Status fits = check_size(name, spec.width, spec.height, bits, probe.max_ratio, bytes.size());
  if (!fits) return fits.error();

  const Result<Layout> layout = choose_layout(spec, probe.format, name);
  if (!layout) return layout.error();
  const std::uint64_t needed =
      std::uint64_t(spec.width) * std::uint64_t(spec.height) * std::uint64_t(layout->channels) * layout->type.size();
  if (needed > max_bytes) {
    return Error{
        ErrorCode::resource_exhausted,
        fmt::format("image of {}x{} needs {} bytes (allowed: at most {})", spec.width, spec.height, needed, max_bytes),
        name};
  }
  if (reserve) {
    if (const Status reserved = reserve(needed); !reserved.ok()) return reserved.error();
  }

  Image image;
  image.name = name;
  image.width = spec.width;
  image.height = spec.height;
  image.channels = layout->channels;
  image.format = layout->format;
  image.texels.resize(needed);
  if (!in->read_image(0, 0, layout->first_channel, layout->first_channel + layout->channels, layout->type,
                      image.texels.data())) {
    return failure();
  }
  return image;
}

}  // namespace

Result<Image> decode_image(std::span<const std::uint8_t> bytes, const std::string& name, std::uint64_t max_bytes,
                           const ReserveBytes& reserve) {
  try {
    return decode(bytes, name, max_bytes, reserve);
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::resource_exhausted, "out of memory while decoding the image", name};
  } catch (const std::exception& e) {
    return broken(name, e.what());
  }
}

}  // namespace helio
