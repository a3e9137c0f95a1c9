// PLY: elements vertex (x y z, nx ny nz, u v or s t) and face (vertex_indices), and of either the attribute that was
// asked for; others are skipped. Attributes of integer type are sRGB, their largest value is white.
#include <algorithm>
#include <charconv>
#include <cstring>
#include <string_view>

#include "renderer/scene/images/texture.h"
#include "renderer/scene/mitsuba/meshes.h"

namespace helio::mitsuba {

namespace {

enum class Encoding { ascii, little, big };
enum class Number : std::uint8_t { i8, u8, i16, u16, i32, u32, f32, f64 };

struct Property {
  std::string name;
  Number type = Number::f32;
  bool list = false;
  Number count_type = Number::u8;
};
struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

int size_of(Number type) {
  constexpr int kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[int(type)];
}

bool number_type(std::string_view name, Number& type) {
  constexpr std::pair<std::string_view, Number> kNames[] = {
      {"char", Number::i8},   {"int8", Number::i8},     {"uchar", Number::u8},  {"uint8", Number::u8},
      {"short", Number::i16}, {"int16", Number::i16},   {"ushort", Number::u16}, {"uint16", Number::u16},
      {"int", Number::i32},   {"int32", Number::i32},   {"uint", Number::u32},  {"uint32", Number::u32},
      {"float", Number::f32}, {"float32", Number::f32}, {"double", Number::f64}, {"float64", Number::f64}};
  for (const auto& [known, value] : kNames)
    if (name == known) {
      type = value;
      return true;
    }
  return false;
}

class PlyParser {
 public:
  PlyParser(std::span<const std::uint8_t> bytes, MemoryBudget& budget, const std::string& attribute,
            std::vector<V4f>* face_colors)
      : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()),
        budget_(budget),
        attribute_(attribute),
        face_colors_(face_colors) {}

  Result<TriangleMesh> parse() {
    if (!read_header()) return error();
    for (const PlyElement& element : elements_)
      if (!read_element(element)) return error();
    if (mesh_.indices.empty()) return Error{ErrorCode::invalid_argument, "holds no face", ""};
    return std::move(mesh_);
  }

 private:
  Error error() const {
    if (refused_.code == ErrorCode::resource_exhausted) return refused_;
    return {ErrorCode::invalid_argument, "byte " + std::to_string(at_) + ": " + problem_, ""};
  }
  bool fail(std::string problem) {
    if (problem_.empty()) problem_ = std::move(problem);
    return false;
  }

  std::string_view line() {
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    std::string_view found = text_.substr(at_, end - at_);
    at_ = std::min(end + 1, text_.size());
    if (!found.empty() && found.back() == '\r') found.remove_suffix(1);
    return found;
  }
  static std::vector<std::string_view> words(std::string_view line) {
    std::vector<std::string_view> out;
    for (;;) {
      line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
      if (line.empty()) return out;
      const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
      out.push_back(line.substr(0, end));
      line.remove_prefix(end);
    }
  }

  bool read_header() {
    if (line() != "ply") return fail("does not begin with \"ply\"");
    bool format = false;
    while (at_ < text_.size()) {
      const std::vector<std::string_view> w = words(line());
      if (w.empty() || w[0] == "comment" || w[0] == "obj_info") continue;
      if (w[0] == "end_header") return format || fail("the header names no format");
      if (w[0] == "format" && w.size() >= 2) {
        format = true;
        if (w[1] == "ascii")
          encoding_ = Encoding::ascii;
        else if (w[1] == "binary_little_endian")
          encoding_ = Encoding::little;
        else if (w[1] == "binary_big_endian")
          encoding_ = Encoding::big;
        else
          return fail("format is not ascii, binary_little_endian or binary_big_endian");
      } else if (w[0] == "element" && w.size() == 3) {
        PlyElement element;
        element.name = w[1];
        const auto [end, code] = std::from_chars(w[2].data(), w[2].data() + w[2].size(), element.count);
        if (code != std::errc() || end != w[2].data() + w[2].size()) return fail("an element's count is not a number");
        elements_.push_back(std::move(element));
      } else if (w[0] == "property" && !elements_.empty() && (w.size() == 3 || (w.size() == 5 && w[1] == "list"))) {
        Property p;
        p.list = w.size() == 5;
        p.name = w.back();
        if (!number_type(w[w.size() - 2], p.type) || (p.list && !number_type(w[2], p.count_type)))
          return fail("a property has an unknown type");
        elements_.back().properties.push_back(std::move(p));
      } else {
        return fail("the header has a line that is neither format, element, property nor comment");
      }
    }
    return fail("the header has no end");
  }

  bool read_number(Number type, double& out) {
    if (encoding_ == Encoding::ascii) {
      while (at_ < text_.size() &&
             (text_[at_] == ' ' || text_[at_] == '\n' || text_[at_] == '\r' || text_[at_] == '\t'))
        ++at_;
      const auto [end, code] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), out);
      if (code == std::errc::invalid_argument) return fail("a number is missing");
      at_ = std::size_t(end - text_.data());
      return true;
    }
    const std::size_t size = std::size_t(size_of(type));
    if (text_.size() - at_ < size) return fail("the file ends before its data");
    std::uint8_t raw[8] = {};
    std::memcpy(raw, text_.data() + at_, size);
    if (encoding_ == Encoding::big)
      for (std::size_t i = 0; i < size / 2; ++i) std::swap(raw[i], raw[size - 1 - i]);
    at_ += size;
    out = decode(type, raw);
    return true;
  }

  static double decode(Number type, const std::uint8_t* raw) {
    const auto as = [&](auto value) {
      std::memcpy(&value, raw, sizeof value);
      return double(value);
    };
    switch (type) {
      case Number::i8: return as(std::int8_t());
      case Number::u8: return as(std::uint8_t());
      case Number::i16: return as(std::int16_t());
      case Number::u16: return as(std::uint16_t());
      case Number::i32: return as(std::int32_t());
      case Number::u32: return as(std::uint32_t());
      case Number::f32: return as(float());
      case Number::f64: break;
    }
    return as(double());
  }

  bool read_element(const PlyElement& element) {
    // Every number takes a byte at least, so that counts cannot exceed the file.
    if (!element.properties.empty() && element.count > (text_.size() - at_) / element.properties.size())
      return fail("element " + element.name + " has more entries than the file has bytes");
    if (element.properties.empty()) return true;
    const bool vertex = element.name == "vertex", face = element.name == "face";
    const std::vector<int> channels = attribute_channels(element);
    const auto found = std::count_if(channels.begin(), channels.end(), [](int channel) { return channel >= 0; });
    const bool colored = found == 3 || (found == 1 && attribute_ != element.name + "_color");
    if (Status s = budget_.reserve(element.count, vertex ? 48 : colored ? 40 : 24, ""); !s.ok()) {
      refused_ = s.error();
      return false;
    }
    const auto corners = std::count_if(element.properties.begin(), element.properties.end(), names_corners);
    if (face && corners > 1)
      return fail("element face has " + std::to_string(corners) + " lists of vertices, allowed: 1");
    std::vector<double> list;
    for (std::uint64_t i = 0; i < element.count; ++i) {
      float values[8] = {};
      unsigned present = 0;
      V4f color(0, 0, 0, 1);
      const std::size_t triangles_before = mesh_.indices.size() / 3;
      for (std::size_t property = 0; property < element.properties.size(); ++property) {
        const Property& p = element.properties[property];
        list.clear();
        double count = 1, value = 0;
        if (p.list && !read_number(p.count_type, count)) return false;
        if (!(count >= 0) || count > double(text_.size() - at_)) return fail("a list is longer than the file");
        if (p.list && !reserve_list(std::uint64_t(count), colored)) return false;
        for (std::uint64_t k = 0; k < std::uint64_t(count); ++k) {
          if (!read_number(p.type, value)) return false;
          if (p.list) list.push_back(value);
        }
        if (colored && channels[property] >= 0) color[channels[property]] = linear_color(p.type, value);
        if (vertex && !p.list) {
          const int slot = vertex_slot(p.name);
          if (slot >= 0) {
            values[slot] = float(value);
            present |= 1u << slot;
          }
        } else if (face && names_corners(p)) {
          if (!add_face(list)) return false;
        }
      }
      if (found == 1) color = V4f(color.x, color.x, color.x, 1);
      if (vertex) add_vertex(values, present);
      if (vertex && colored) mesh_.colors.push_back(color);
      if (face && colored && face_colors_)
        face_colors_->insert(face_colors_->end(), mesh_.indices.size() / 3 - triangles_before, color);
    }
    return true;
  }

  // Beyond a list's first three entries and the triangle that they make, which have been reserved with the face: what
  // the list itself takes, and further triangles with their colours.
  bool reserve_list(std::uint64_t count, bool colored) {
    constexpr std::uint64_t kFirst = 3;
    if (count <= kFirst) return true;
    Status s = budget_.reserve(count - kFirst, sizeof(double) + (colored ? 28 : 12), "");
    if (!s.ok()) refused_ = s.error();
    return s.ok();
  }

  static bool names_corners(const Property& p) {
    return p.list && (p.name == "vertex_indices" || p.name == "vertex_index");
  }

  static int vertex_slot(const std::string& name) {
    constexpr std::string_view kNames[] = {"x", "y", "z", "nx", "ny", "nz", "u", "v"};
    for (int i = 0; i < 8; ++i)
      if (name == kNames[i]) return i;
    if (name == "s" || name == "texture_u") return 6;
    if (name == "t" || name == "texture_v") return 7;
    return -1;
  }

  // Of every property which channel of the attribute it is; -1: none.
  std::vector<int> attribute_channels(const PlyElement& element) const {
    std::vector<int> channels(element.properties.size(), -1);
    const std::string kind = element.name + "_";
    if ((kind != "vertex_" && kind != "face_") || !attribute_.starts_with(kind)) return channels;
    const std::string_view wanted = std::string_view(attribute_).substr(kind.size());
    if (wanted.empty()) return channels;
    int next = 0;
    for (std::size_t i = 0; i < channels.size(); ++i) {
      const Property& p = element.properties[i];
      if (p.list || next == 4 || attribute_name(p.name) != wanted) continue;
      const int plain = plain_channel(p.name);
      channels[i] = plain >= 0 ? plain : next;
      ++next;
    }
    return channels;
  }

  // Of a colour without a name.
  static int plain_channel(const std::string& property) {
    constexpr std::string_view kNames[] = {"r", "g", "b", "red", "green", "blue"};
    for (int i = 0; i < 6; ++i)
      if (property == kNames[i]) return i % 3;
    return -1;
  }

  // What Mitsuba calls the attribute that the property is a channel of, less vertex_ or face_; empty: none.
  static std::string attribute_name(const std::string& property) {
    if (plain_channel(property) >= 0) return "color";
    const std::size_t bar = property.rfind('_');
    if (bar == std::string::npos || bar + 2 != property.size()) return {};
    const char channel = property.back();
    if (std::string_view("rgba").find(channel) != std::string_view::npos) return property.substr(0, bar) + "_color";
    if (std::string_view("xyzw01234").find(channel) != std::string_view::npos) return property.substr(0, bar);
    return {};
  }

  // As Mitsuba 3.9 reads integers, but for bytes, which it takes as they are, with 255 as a reflectance.
  static float linear_color(Number type, double value) {
    constexpr double kLargest[] = {127, 255, 32767, 65535, 2147483647, 4294967295};
    return type < Number::f32 ? srgb_to_linear(float(value / kLargest[int(type)])) : float(value);
  }

  void add_vertex(const float* v, unsigned present) {
    mesh_.positions.emplace_back(v[0], v[1], v[2]);
    if ((present & 0x38) == 0x38) mesh_.normals.emplace_back(v[3], v[4], v[5]);
    if ((present & 0xC0) == 0xC0) mesh_.texcoords[0].emplace_back(v[6], v[7]);
  }

  bool add_face(const std::vector<double>& list) {
    for (const double index : list)
      if (!(index >= 0) || index > 4294967295.0) return fail("a face's index is negative or too large");
    for (std::size_t k = 2; k < list.size(); ++k)
      mesh_.indices.insert(mesh_.indices.end(),
                           {std::uint32_t(list[0]), std::uint32_t(list[k - 1]), std::uint32_t(list[k])});
    return true;
  }

  std::string_view text_;
  MemoryBudget& budget_;
  const std::string& attribute_;
  std::vector<V4f>* face_colors_;  // may be null
  std::size_t at_ = 0;
  Encoding encoding_ = Encoding::ascii;
  std::vector<PlyElement> elements_;
  TriangleMesh mesh_;
  std::string problem_;
  Error refused_;
};

}  // namespace

Result<TriangleMesh> parse_ply(std::span<const std::uint8_t> bytes, MemoryBudget& budget, const std::string& attribute,
                               std::vector<V4f>* face_colors) {
  return PlyParser(bytes, budget, attribute, face_colors).parse();
}

}  // namespace helio::mitsuba
