#include "renderer/scene/images/image_decoder.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <exception>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <new>
#include <utility>
#include <vector>

#include "renderer/scene/images/image_probe.h"
#include "renderer/scene/images/png_decoder.h"

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

struct Layout {
  int first_channel = 0, channels = 0;
  TexelFormat format = TexelFormat::u8;
  OIIO::TypeDesc type;
};

// Consecutive channels that make colour, R, G, B, A, R, G, B, Y, A or Y, of one layer.
struct ColourRun {
  std::string layer;  // "": none
  int first = 0, channels = 0;
};

// Splits "diffuse.R" into "diffuse" and "R".
std::pair<std::string, std::string> layer_and_suffix(const std::string& channel) {
  const std::size_t dot = channel.rfind('.');
  if (dot == std::string::npos) return {"", channel};
  return {channel.substr(0, dot), channel.substr(dot + 1)};
}

// One of each layer that has colour, the one of most channels. (OpenImageIO sorts each layer to R, G, B, A.)
std::vector<ColourRun> colour_runs(const OIIO::ImageSpec& spec) {
  std::vector<ColourRun> runs;
  const auto matches = [&](int first, const std::string& layer, std::initializer_list<const char*> names) {
    int channel = first;
    for (const char* wanted : names) {
      if (channel >= spec.nchannels) return false;
      if (layer_and_suffix(spec.channelnames[std::size_t(channel)]) != std::pair(layer, std::string(wanted))) return false;
      ++channel;
    }
    return true;
  };
  for (int first = 0; first < spec.nchannels; ++first) {
    const std::string layer = layer_and_suffix(spec.channelnames[std::size_t(first)]).first;
    const int channels = matches(first, layer, {"R", "G", "B", "A"}) ? 4
                         : matches(first, layer, {"R", "G", "B"})    ? 3
                         : matches(first, layer, {"Y", "A"})         ? 2
                         : matches(first, layer, {"Y"})              ? 1
                                                                     : 0;
    if (channels == 0) continue;
    const auto known = std::find_if(runs.begin(), runs.end(), [&](const ColourRun& run) { return run.layer == layer; });
    if (known == runs.end()) {
      runs.push_back({layer, first, channels});
    } else if (channels > known->channels) {
      *known = {layer, first, channels};
    }
  }
  return runs;
}

// What programs call the layer that shows the picture.
bool is_default_layer(const std::string& layer) {
  std::string last = layer_and_suffix(layer).second;
  std::transform(last.begin(), last.end(), last.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return last == "combined" || last == "beauty" || last == "rgba" || last == "rgb" || last == "default";
}

std::string quoted_list(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 8;
  std::string all;
  for (std::size_t i = 0; i < std::min(names.size(), kMost); ++i) {
    all += (i ? ", \"" : "\"") + names[i].substr(0, 60) + "\"";
  }
  if (names.size() > kMost) all += fmt::format(" and {} more", names.size() - kMost);
  return all;
}

// An EXR's colour channels by convention.
Result<ColourRun> choose_run(const OIIO::ImageSpec& spec, const std::string& name, std::vector<std::string>& notices) {
  // OpenImageIO 2.4 hands chroma out as colour when it is not subsampled; 2.5 converts to R, G, B, but reads some
  // of these images as black.
  bool luminance_chroma = spec.get_int_attribute("openexr:luminancechroma") != 0;
  std::vector<std::string> layers;  // that have a name
  for (const std::string& channel : spec.channelnames) {
    const auto [layer, suffix] = layer_and_suffix(channel);
    luminance_chroma = luminance_chroma || suffix == "RY" || suffix == "BY";
    if (!layer.empty() && std::find(layers.begin(), layers.end(), layer) == layers.end()) layers.push_back(layer);
  }
  if (luminance_chroma) {
    return broken(name, "luminance-chroma EXR images, subsampled or not (allowed: R, G, B, A, or Y alone)");
  }
  const std::vector<ColourRun> runs = colour_runs(spec);
  if (runs.empty()) {
    if (spec.nchannels == 1) return ColourRun{"", 0, 1};
    return broken(name, fmt::format("no colour channels among {} (allowed: R, G, B, A or Y, or a single channel)",
                                    fmt::join(spec.channelnames, ", ")));
  }
  const auto unnamed = std::find_if(runs.begin(), runs.end(), [](const ColourRun& run) { return run.layer.empty(); });
  const auto is_default = [](const ColourRun& run) { return is_default_layer(run.layer); };
  auto taken = unnamed;
  if (taken == runs.end() && runs.size() == 1) taken = runs.begin();
  if (taken == runs.end() && std::count_if(runs.begin(), runs.end(), is_default) == 1) {
    taken = std::find_if(runs.begin(), runs.end(), is_default);
  }
  if (taken == runs.end()) {
    std::vector<std::string> names;
    for (const ColourRun& run : runs) names.push_back(run.layer);
    return broken(name, fmt::format("the layers {} leave a choice (allowed: R, G, B without a layer, a single layer with "
                                    "colour, or one called Combined, beauty, rgba or default)",
                                    quoted_list(names)));
  }
  std::erase(layers, taken->layer);
  const std::string what = taken->layer.empty() ? "its channels without a layer are" : "its layer \"" + taken->layer + "\" is";
  if (!layers.empty()) {
    notices.push_back(fmt::format("{}: {} used, not {}", name, what, quoted_list(layers)));
  } else if (!taken->layer.empty()) {
    notices.push_back(fmt::format("{}: {} used", name, what));
  }
  return *taken;
}

// Makes `in` stand at the part of an EXR that holds the picture; `spec` is the first part's, then the chosen one's.
Status choose_part(OIIO::ImageInput& in, OIIO::ImageSpec& spec, const std::string& name,
                   std::vector<std::string>& notices) {
  const int parts = std::max(1, spec.get_int_attribute("oiio:subimages", 1));
  if (parts == 1) return ok_status();
  std::vector<std::string> names;
  std::vector<int> coloured;
  for (int part = 0; part < parts; ++part) {
    if (!in.seek_subimage(part, 0)) return broken(name, fmt::format("part {} of {} cannot be read", part + 1, parts));
    const OIIO::ImageSpec& of_part = in.spec();
    const std::string part_name(of_part.get_string_attribute("oiio:subimagename"));
    names.push_back(part_name.empty() ? fmt::format("part {}", part + 1) : part_name);
    if (!colour_runs(of_part).empty() || of_part.nchannels == 1) coloured.push_back(part);
  }
  const auto chosen = coloured.empty() ? 0 : coloured.front();
  if (chosen != 0 && coloured.size() > 1) {
    std::vector<std::string> choice;
    for (const int part : coloured) choice.push_back(names[std::size_t(part)]);
    return broken(name, fmt::format("the parts {} leave a choice (allowed: colour in the first part, or in a single one)",
                                    quoted_list(choice)));
  }
  if (!in.seek_subimage(chosen, 0)) return broken(name, "its parts cannot be read");
  spec = in.spec();
  const std::string taken = names[std::size_t(chosen)];
  names.erase(names.begin() + chosen);
  notices.push_back(fmt::format("{}: its part \"{}\" is used, not {}", name, taken.substr(0, 60), quoted_list(names)));
  return ok_status();
}

// The channels to take: all of an ordinary image, the colour of an EXR.
Result<Layout> choose_layout(const OIIO::ImageSpec& spec, ImageFormat format, const std::string& name,
                             std::vector<std::string>& notices) {
  Layout layout;
  layout.channels = std::min(spec.nchannels, 4);
  if (format == ImageFormat::exr) {
    const Result<ColourRun> run = choose_run(spec, name, notices);
    if (!run) return run.error();
    layout.first_channel = run->first;
    layout.channels = run->channels;
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

// The part of an EXR's data window that lies in its display window, which the picture is.
struct Windows {
  std::int64_t left = 0, top = 0;  // of the data window in the picture
  int width = 0, height = 0;       // of the picture

  bool differ(const OIIO::ImageSpec& spec) const {
    return left != 0 || top != 0 || width != spec.width || height != spec.height;
  }
};

Windows windows_of(const OIIO::ImageSpec& spec, ImageFormat format) {
  if (format != ImageFormat::exr) return {0, 0, spec.width, spec.height};
  return {std::int64_t(spec.x) - spec.full_x, std::int64_t(spec.y) - spec.full_y, spec.full_width, spec.full_height};
}

// Copies what was stored to its place; nothing overlaps: false.
bool place_texels(const std::vector<std::uint8_t>& stored, const OIIO::ImageSpec& spec, const Windows& windows,
                  std::size_t texel_bytes, std::vector<std::uint8_t>& texels) {
  const std::int64_t x0 = std::max<std::int64_t>(0, windows.left);
  const std::int64_t x1 = std::min<std::int64_t>(windows.width, windows.left + spec.width);
  const std::int64_t y0 = std::max<std::int64_t>(0, windows.top);
  const std::int64_t y1 = std::min<std::int64_t>(windows.height, windows.top + spec.height);
  if (x0 >= x1 || y0 >= y1) return false;
  for (std::int64_t y = y0; y < y1; ++y) {
    const auto from = std::size_t((y - windows.top) * spec.width + x0 - windows.left);
    const auto to = std::size_t(y * windows.width + x0);
    std::memcpy(texels.data() + to * texel_bytes, stored.data() + from * texel_bytes, std::size_t(x1 - x0) * texel_bytes);
  }
  return true;
}

Result<Image> decode(std::span<const std::uint8_t> bytes, const std::string& name, std::uint64_t max_bytes,
                     std::vector<std::string>& notices, const ReserveBytes& reserve) {
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
    if (probe.format == ImageFormat::exr) {
      const Status shown = check_size(name, probe.display_width, probe.display_height, 0, 0, bytes.size());
      if (!shown) return shown.error();
    }
  }

  const auto admit = [&](int width, int height, std::uint64_t most) -> Status {
    if (most > max_bytes) {
      return Error{ErrorCode::resource_exhausted,
                   fmt::format("image of {}x{} needs {} bytes (allowed: at most {})", width, height, most, max_bytes),
                   name};
    }
    return reserve ? reserve(most) : ok_status();
  };
  if (probe.format == ImageFormat::png) return decode_png(bytes, name, admit);

  disable_library_threads();
  const std::unique_ptr<OIIO::ImageInput> in = OIIO::ImageInput::create(reader_name(probe.format));
  if (!in || !in->supports("ioproxy")) {
    OIIO::geterror();
    return Error{ErrorCode::unimplemented,
                 fmt::format("the installed OpenImageIO cannot read {} from memory", reader_name(probe.format)), name};
  }
  OIIO::Filesystem::IOMemReader memory(const_cast<std::uint8_t*>(bytes.data()), bytes.size());
  OIIO::ImageSpec hints, spec;
  hints.attribute("oiio:UnassociatedAlpha", 1);
  hints.attribute("oiio:reorient", 0);
  const auto failure = [&] {
    const std::string said = in->geterror();
    return broken(name, said.empty() ? "image cannot be decoded" : said);
  };
  if (!in->set_ioproxy(&memory) || !in->open("image", spec, hints)) return failure();
  if (probe.format == ImageFormat::exr) {
    const Status chosen = choose_part(*in, spec, name, notices);
    if (!chosen) return chosen.error();
  }

  // The probe saw the claim that decoders act on first; this is the one that the pixels will have.
  if (spec.depth > 1) return broken(name, fmt::format("image is a volume of depth {} (allowed: 1)", spec.depth));
  if (spec.nchannels < 1) return broken(name, "image has no channels");
  const double bits = probe.bits_per_pixel > 0 ? probe.bits_per_pixel
                      : probe.format == ImageFormat::pnm
                          ? spec.nchannels * (spec.get_int_attribute("oiio:BitsPerSample", 8) == 1 ? 1 : 8)
                          : 32;
  const Status fits = check_size(name, spec.width, spec.height, bits, probe.max_ratio, bytes.size());
  if (!fits) return fits.error();

  const Result<Layout> layout = choose_layout(spec, probe.format, name, notices);
  if (!layout) return layout.error();
  const Windows windows = windows_of(spec, probe.format);
  if (const Status shown = check_size(name, windows.width, windows.height, 0, 0, bytes.size()); !shown) {
    return shown.error();
  }
  const std::size_t texel_bytes = std::size_t(layout->channels) * layout->type.size();
  const auto bytes_of = [&](int width, int height) {
    return std::uint64_t(width) * std::uint64_t(height) * std::uint64_t(texel_bytes);
  };
  const std::uint64_t stored_bytes = bytes_of(spec.width, spec.height);
  const std::uint64_t needed = bytes_of(windows.width, windows.height);
  // Both are held while texels are placed.
  const std::uint64_t most = windows.differ(spec) ? needed + stored_bytes : needed;
  if (const Status admitted = admit(windows.width, windows.height, most); !admitted.ok()) return admitted.error();

  Image image;
  image.name = name;
  image.width = windows.width;
  image.height = windows.height;
  image.channels = layout->channels;
  image.format = layout->format;
  image.texels.resize(std::size_t(stored_bytes));
  const int end_channel = layout->first_channel + layout->channels;
  if (!in->read_image(in->current_subimage(), 0, layout->first_channel, end_channel, layout->type,
                      image.texels.data())) {
    return failure();
  }
  if (!windows.differ(spec)) return image;
  const std::vector<std::uint8_t> stored = std::move(image.texels);
  image.texels.assign(std::size_t(needed), 0);
  if (!place_texels(stored, spec, windows, texel_bytes, image.texels)) {
    return broken(name, fmt::format("its data window ({}x{} texels at {}, {}) lies outside of its display window ({}x{})",
                                    spec.width, spec.height, windows.left, windows.top, windows.width, windows.height));
  }
  notices.push_back(fmt::format("{}: stores {}x{} texels at ({}, {}) of its picture of {}x{}; what is missing is black",
                                name, spec.width, spec.height, windows.left, windows.top, windows.width,
                                windows.height));
  return image;
}

}  // namespace

Result<Image> decode_image(std::span<const std::uint8_t> bytes, const std::string& name, std::uint64_t max_bytes,
                           std::vector<std::string>* notices, const ReserveBytes& reserve) {
  try {
    std::vector<std::string> lines;
    Result<Image> image = decode(bytes, name, max_bytes, lines, reserve);
    if (image && notices) notices->insert(notices->end(), lines.begin(), lines.end());
    return image;
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::resource_exhausted, "out of memory while decoding the image", name};
  } catch (const std::exception& e) {
    return broken(name, e.what());
  }
}

}  // namespace helio
