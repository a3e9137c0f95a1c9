#include "server/jobs/checkpoint_header.h"

#include <charconv>
#include <nlohmann/json.hpp>

#include "renderer/codec/sha256.h"

namespace helio {
namespace {

using Json = nlohmann::json;

std::optional<std::string> from_hex(const std::string& text) {
  if (text.size() % 2 != 0) return std::nullopt;
  std::string bytes;
  for (std::size_t i = 0; i < text.size(); i += 2) {
    unsigned value = 0;
    const char* const end_of_byte = text.data() + i + 2;
    const auto [end, error] = std::from_chars(text.data() + i, end_of_byte, value, 16);
    if (error != std::errc() || end != end_of_byte) return std::nullopt;
    bytes.push_back(char(value));
  }
  return bytes;
}

}  // namespace

std::string CheckpointHeader::write() const {
  Json json{{"view", view}, {"build", build}, {"same_bits", same_bits}};
  const auto hex = [](const std::string& bytes) {
    return to_hex({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  };
  if (frame_end) json["frame_end"] = hex(*frame_end);
  if (!progress.empty()) json["progress"] = hex(progress);
  if (time_s > 0) json["time_s"] = time_s;
  return json.dump();
}

std::optional<CheckpointHeader> CheckpointHeader::read(const std::string& text) {
  const Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) return std::nullopt;
  try {
    CheckpointHeader header;
    header.view = json.at("view");
    header.build = json.at("build");
    header.same_bits = json.at("same_bits");
    if (json.contains("frame_end")) {
      header.frame_end = from_hex(json.at("frame_end"));
      if (!header.frame_end) return std::nullopt;
    }
    if (json.contains("progress")) header.progress = from_hex(json.at("progress")).value_or("");
    header.time_s = json.value("time_s", 0.0);
    return header;
  } catch (const Json::exception&) {
    return std::nullopt;
  }
}

}  // namespace helio
