#include "client/cli/edit_options.h"

#include <spdlog/fmt/fmt.h>

#include <charconv>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <optional>
#include <string_view>

namespace helio::cli {

namespace pb = heliograph::v1;

const char* const kEditHelp =
    "An edit is TARGET=key:value, several keys separated by ';'. TARGET is a name of the file, or # and a number from "
    "0.\n"
    "  --object TARGET=move:x,y,z | turn:x,y,z,degrees (axis through the world's origin) | scale:s or scale:x,y,z "
    "(from the\n"
    "    world's origin) | matrix:12 numbers (object to world, row by row, in place of what it was). In the order "
    "given.\n"
    "  --material TARGET=color:r,g,b ([0, 1]) | emission:r,g,b (W / (sr m^2)) | roughness:r ([0, 1])\n"
    "  --light TARGET=intensity:r,g,b | scale:s            a point, spot or directional light\n"
    "  --environment-light radiance:r,g,b | scale:s\n"
    "Example: heliograph edit room.glb --server 127.0.0.1:50051 --material 'Lamp=emission:9,8,7' --object '#3=move:0,0.5,0'\n\n";

namespace {

using Numbers = std::vector<double>;

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  std::size_t start = 0;
  for (std::size_t end; (end = text.find(separator, start)) != std::string_view::npos; start = end + 1) {
    parts.push_back(text.substr(start, end - start));
  }
  parts.push_back(text.substr(start));
  return parts;
}

std::optional<Numbers> read_numbers(std::string_view text) {
  Numbers numbers;
  for (const std::string_view part : split(text, ',')) {
    double value = 0;
    const auto [end, problem] = std::from_chars(part.data(), part.data() + part.size(), value);
    if (problem != std::errc() || end != part.data() + part.size() || !std::isfinite(value)) return std::nullopt;
    numbers.push_back(value);
  }
  return numbers;
}

// What may be said of a target.
struct Key {
  std::vector<std::size_t> counts;  // of numbers
  std::string form;
  std::function<void(const Numbers&)> take;
};
using Keys = std::map<std::string, Key, std::less<>>;

void read_values(std::string_view text, const Keys& keys, const std::string& where, Problems& problems) {
  for (const std::string_view part : split(text, ';')) {
    const std::size_t colon = part.find(':');
    const auto key = keys.find(part.substr(0, colon));
    if (colon == std::string_view::npos || key == keys.end()) {
      std::string allowed;
      for (const auto& [name, entry] : keys) allowed += (allowed.empty() ? "" : ", ") + name + ":" + entry.form;
      problems.add(where, fmt::format("'{}' is none of {}", part, allowed));
      continue;
    }
    const auto numbers = read_numbers(part.substr(colon + 1));
    const auto& counts = key->second.counts;
    if (!numbers || std::find(counts.begin(), counts.end(), numbers->size()) == counts.end()) {
      problems.add(where, fmt::format("'{}' is not {}:{}, each number finite", part, key->first, key->second.form));
      continue;
    }
    key->second.take(*numbers);
  }
}

// The values behind the last '=' of the text; what stands before it becomes the target.
template <class Message>
std::optional<std::string_view> read_target(std::string_view text, Message& message, const std::string& where,
                                            Problems& problems) {
  const std::size_t equals = text.rfind('=');
  const std::string_view target = text.substr(0, equals);
  if (equals == std::string_view::npos || target.empty()) {
    problems.add(where, fmt::format("'{}' is not TARGET=key:value", text));
    return std::nullopt;
  }
  std::uint32_t index = 0;
  const char* const end = target.data() + target.size();
  if (target[0] == '#') {
    const auto [stop, problem] = std::from_chars(target.data() + 1, end, index);
    if (problem != std::errc() || stop != end) {
      problems.add(where, fmt::format("'{}' is not # and a number from 0", target));
      return std::nullopt;
    }
    message.set_index(index);
  } else {
    message.set_name(std::string(target));
  }
  return text.substr(equals + 1);
}

void set(pb::Vec3& message, const Numbers& v) {
  message.set_x(v[0]);
  message.set_y(v[1]);
  message.set_z(v[2]);
}

// Rows of an affine map, as ObjectEdit has them.
Numbers identity() {
  return {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
}

// Rodrigues' formula; the axis need not be unit.
std::optional<Numbers> rotation(const Numbers& v) {
  const double length = std::hypot(v[0], v[1], v[2]);
  if (!(length > 0) || !std::isfinite(length)) return std::nullopt;
  const double x = v[0] / length, y = v[1] / length, z = v[2] / length;
  const double angle = v[3] * std::numbers::pi / 180, c = std::cos(angle), s = std::sin(angle), t = 1 - c;
  return Numbers{t * x * x + c,     t * x * y - s * z, t * x * z + s * y, 0,
                 t * x * y + s * z, t * y * y + c,     t * y * z - s * x, 0,
                 t * x * z - s * y, t * y * z + s * x, t * z * z + c,     0};
}

class Reader {
 public:
  explicit Reader(Problems& problems) : problems_(problems) {}

  void object(const std::string& text) {
    pb::ObjectEdit target;
    const auto values = read_target(text, target, "--object", problems_);
    if (!values) return;
    const auto add = [&](const Numbers& rows, bool relative) {
      pb::ObjectEdit& edit = *edits_.emplace_back().mutable_object();
      edit = target;
      edit.mutable_transform()->Add(rows.begin(), rows.end());
      edit.set_relative(relative);
    };
    const auto move = [&](const Numbers& v) {
      Numbers rows = identity();
      for (std::size_t i = 0; i < 3; ++i) rows[4 * i + 3] = v[i];
      add(rows, true);
    };
    const auto scale = [&](const Numbers& v) {
      Numbers rows = identity();
      for (std::size_t i = 0; i < 3; ++i) rows[5 * i] = v[v.size() == 1 ? 0 : i];
      add(rows, true);
    };
    const auto turn = [&](const Numbers& v) {
      if (const auto rows = rotation(v)) return add(*rows, true);
      problems_.add("--object", "turn: the axis is zero; allowed: any direction");
    };
    read_values(*values,
                {{"move", {{3}, "x,y,z", move}},
                 {"turn", {{4}, "x,y,z,degrees", turn}},
                 {"scale", {{1, 3}, "s or scale:x,y,z", scale}},
                 {"matrix", {{12}, "12 numbers", [&](const Numbers& rows) { add(rows, false); }}}},
                "--object", problems_);
  }

  void material(const std::string& text) {
    pb::SceneEdit edit;
    pb::MaterialEdit& message = *edit.mutable_material();
    const auto values = read_target(text, message, "--material", problems_);
    if (!values) return;
    read_values(*values,
                {{"color", {{3}, "r,g,b", [&](const Numbers& v) { set(*message.mutable_base_color(), v); }}},
                 {"emission", {{3}, "r,g,b", [&](const Numbers& v) { set(*message.mutable_emission(), v); }}},
                 {"roughness", {{1}, "r", [&](const Numbers& v) { message.set_roughness(v[0]); }}}},
                "--material", problems_);
    edits_.push_back(std::move(edit));
  }

  void light(const std::string& text) {
    pb::SceneEdit edit;
    pb::LightEdit& message = *edit.mutable_light();
    const auto values = read_target(text, message, "--light", problems_);
    if (!values) return;
    read_values(*values,
                {{"intensity", {{3}, "r,g,b", [&](const Numbers& v) { set(*message.mutable_intensity(), v); }}},
                 {"scale", {{1}, "s", [&](const Numbers& v) { message.set_scale(v[0]); }}}},
                "--light", problems_);
    edits_.push_back(std::move(edit));
  }

  void environment(const std::string& text) {
    pb::SceneEdit edit;
    pb::EnvironmentEdit& message = *edit.mutable_environment();
    read_values(text,
                {{"radiance", {{3}, "r,g,b", [&](const Numbers& v) { set(*message.mutable_radiance(), v); }}},
                 {"scale", {{1}, "s", [&](const Numbers& v) { message.set_scale(v[0]); }}}},
                "--environment-light", problems_);
    edits_.push_back(std::move(edit));
  }

  std::vector<pb::SceneEdit> take() { return std::move(edits_); }

 private:
  Problems& problems_;
  std::vector<pb::SceneEdit> edits_;
};

}  // namespace

void add_edit_options(CLI::App& app, EditOptions& options) {
  add_texts(app, options.objects, "--object", "TARGET=VALUES", "Move an object; may be repeated, as the others");
  add_texts(app, options.materials, "--material", "TARGET=VALUES", "Colour, emission or roughness of a material");
  add_texts(app, options.lights, "--light", "TARGET=VALUES", "Intensity of a point, spot or directional light");
  add_texts(app, options.environment, "--environment-light", "VALUES", "Brightness and colour of the environment");
}

std::vector<pb::SceneEdit> read_edits(const EditOptions& options, Problems& problems) {
  Reader reader(problems);
  for (const std::string& text : options.objects) reader.object(text);
  for (const std::string& text : options.materials) reader.material(text);
  for (const std::string& text : options.lights) reader.light(text);
  for (const std::string& text : options.environment) reader.environment(text);
  return reader.take();
}

}  // namespace helio::cli
