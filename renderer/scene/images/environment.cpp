#include "renderer/scene/images/environment.h"

#include <spdlog/fmt/fmt.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

#include "renderer/base/text.h"
#include "renderer/scene/description/file_source.h"
#include "renderer/scene/images/image_decoder.h"

namespace helio {
namespace {

// A number beyond a float is infinite, which no radiance may be; one too close to 0 for a float is 0.
std::optional<float> parse_float(std::string_view text) {
  float value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc::result_out_of_range && end == text.data() + text.size()) {
    const bool tiny = text.find("e-") != std::string_view::npos || text.find("E-") != std::string_view::npos;
    return tiny ? 0 : std::numeric_limits<float>::infinity();
  }
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// Three numbers, or nothing when `text` does not consist of comma-separated numbers: then it is a file name.
std::optional<std::vector<float>> parse_numbers(std::string_view text) {
  std::vector<float> numbers;
  for (const std::string_view part : comma_separated(text)) {
    const std::optional<float> number = parse_float(part);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

}  // namespace

V2f environment_uv(const V3f& d) {
  float u = std::atan2(d.x, -d.z) * (0.5f * kInvPi);
  if (u < 0) u += 1;
  // atan2 keeps its accuracy near the poles, where acos loses half of the digits.
  const float v = std::atan2(std::sqrt(d.x * d.x + d.z * d.z), d.y) * kInvPi;
  return {std::min(u, kOneMinusEpsilon), std::min(v, kOneMinusEpsilon)};
}

V3f environment_direction(const V2f& uv) {
  const float phi = kTwoPi * uv.x, theta = kPi * uv.y;
  const float sin_theta = std::sin(theta);
  return {std::sin(phi) * sin_theta, std::cos(theta), -std::cos(phi) * sin_theta};
}

Result<Environment> parse_environment(const std::string& text, const FileSource* source, std::uint64_t max_bytes,
                                      std::vector<Image>& images, std::vector<std::string>* notices,
                                      const ReserveBytes& reserve) {
  const std::string name(trim(text));
  if (name.empty()) {
    return Error{ErrorCode::invalid_argument, "is empty (allowed: R,G,B or the name of an image file)", "environment"};
  }
  Environment environment;
  if (const std::optional<std::vector<float>> numbers = parse_numbers(name)) {
    if (numbers->size() != 3) {
      return Error{ErrorCode::invalid_argument,
                   fmt::format("\"{}\" has {} numbers (allowed: three, R,G,B)", name, numbers->size()), "environment"};
    }
    for (const float number : *numbers) {
      if (!std::isfinite(number) || number < 0) {
        return Error{ErrorCode::invalid_argument,
                     fmt::format("\"{}\" has the radiance {} (allowed: R,G,B, each in [0, 3.4e38])", name, number),
                     "environment"};
      }
    }
    environment.radiance = Rgb((*numbers)[0], (*numbers)[1], (*numbers)[2]);
    return environment;
  }
  if (!source) {
    return Error{ErrorCode::failed_precondition,
                 fmt::format("\"{}\" names a file, but none can be read here (allowed: R,G,B)", name), "environment"};
  }
  const Result<std::vector<std::uint8_t>> bytes = source->read(name, max_bytes);
  if (!bytes) return bytes.error();
  Result<Image> image = decode_image(*bytes, name, max_bytes, notices, reserve);
  if (!image) return image.error();
  const Status usable = prepare_environment_image(*image);
  if (!usable) return usable.error();
  environment.image = int(images.size());
  images.push_back(std::move(*image));
  return environment;
}

}  // namespace helio
