// A glTF file as plain typed data: every index is checked against the array it points into, every number against its
// range. Nothing here has looked at a byte of a buffer yet.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "renderer/scene/description/scene_description.h"
#include "renderer/scene/gltf/document/extensions.h"
#include "renderer/scene/gltf/document/json.h"

namespace helio::gltf {

// ---- data ----------------------------------------------------------------------------------------------------------

struct Buffer {
  std::optional<std::string> uri;
  std::uint64_t byte_length = 0;
  bool is_fallback = false;  // EXT_meshopt_compression: stands in for data that only exists compressed
};

enum class MeshoptMode { attributes, triangles, indices };
enum class MeshoptFilter { none, octahedral, quaternion, exponential };

// EXT_meshopt_compression: where the compressed bytes of a view lie, and what they decode to.
struct MeshoptView {
  int buffer = -1;
  std::uint64_t byte_offset = 0, byte_length = 0, byte_stride = 0, count = 0;
  MeshoptMode mode = MeshoptMode::attributes;
  MeshoptFilter filter = MeshoptFilter::none;
};

struct BufferView {
  int buffer = -1;
  std::uint64_t byte_offset = 0, byte_length = 0;
  std::uint64_t byte_stride = 0;  // 0: tightly packed
  int target = 0;                 // 0, 34962 (vertices) or 34963 (indices)
  std::optional<MeshoptView> meshopt;
};

enum class ComponentType { i8 = 5120, u8 = 5121, i16 = 5122, u16 = 5123, u32 = 5125, f32 = 5126 };
enum class ElementType { scalar, vec2, vec3, vec4, mat2, mat3, mat4 };

std::uint64_t component_size(ComponentType type);
int component_count(ElementType type);
const char* name_of(ComponentType type);
const char* name_of(ElementType type);

struct SparsePatch {
  std::uint64_t count = 0;
  int index_view = -1, value_view = -1;
  std::uint64_t index_offset = 0, value_offset = 0;
  ComponentType index_type = ComponentType::u16;
};

struct Accessor {
  int view = -1;  // < 0: all zero, before the sparse patch
  std::uint64_t byte_offset = 0, count = 0;
  ComponentType component = ComponentType::f32;
  ElementType type = ElementType::scalar;
  bool normalized = false;
  std::optional<SparsePatch> sparse;
  std::vector<double> min, max;  // empty when not given

  // Bytes of one element, with the padding of matrix columns (glTF 2.0, 3.6.2.4).
  std::uint64_t element_size() const;
};

// ---- images and textures -------------------------------------------------------------------------------------------

struct ImageSource {
  std::string name;
  std::optional<std::string> uri;
  int view = -1;
  std::string mime_type;
};

struct Sampler {
  WrapMode wrap_u = WrapMode::repeat, wrap_v = WrapMode::repeat;
  FilterMode filter = FilterMode::bilinear;
};

struct Texture {
  int sampler = -1;
  int source = -1;  // < 0: no image that we can read; the texture is left out
};

// ---- meshes --------------------------------------------------------------------------------------------------------

struct Attribute {
  std::string semantic;
  int accessor = -1;
};

struct DracoPrimitive {
  int view = -1;
  std::vector<std::pair<std::string, std::uint32_t>> attributes;  // semantic, draco's unique id
};

enum class Topology { points = 0, lines, line_loop, line_strip, triangles, triangle_strip, triangle_fan };

struct Primitive {
  std::vector<Attribute> attributes;
  std::vector<std::vector<Attribute>> targets;
  int indices = -1, material = -1;
  Topology topology = Topology::triangles;
  std::optional<DracoPrimitive> draco;

  int find(std::string_view semantic) const;  // accessor, or -1
};

struct Mesh {
  std::string name;
  std::vector<Primitive> primitives;
  std::vector<float> weights;  // one per morph target

  std::size_t target_count() const { return primitives.empty() ? 0 : primitives.front().targets.size(); }
};

// ---- nodes ---------------------------------------------------------------------------------------------------------

struct Trs {
  V3d translation{0, 0, 0};
  std::array<double, 4> rotation{0, 0, 0, 1};  // unit quaternion x, y, z, w
  V3d scale{1, 1, 1};
};

// Row-vector matrix of scale, then rotation, then translation.
M44d to_matrix(const Trs& trs);
// Whether an odd number of its scales is below 0.
bool is_mirrored(const Trs& trs);

struct GpuInstancing {
  int translation = -1, rotation = -1, scale = -1;  // accessors
  std::uint64_t count = 0;
};

struct Node {
  std::string name;
  std::vector<int> children;
  int parent = -1;
  int mesh = -1, skin = -1, camera = -1, light = -1;
  std::optional<M44d> matrix;  // else trs
  Trs trs;
  std::vector<float> weights;  // empty: the mesh's
  std::optional<GpuInstancing> instancing;
  std::optional<Sphere> sphere;  // extras.heliograph
};

struct Skin {
  std::vector<int> joints;
  int inverse_bind_matrices = -1;
  int skeleton = -1;
};

struct SceneRoot {
  std::string name;
  std::vector<int> nodes;
};

// ---- animations ----------------------------------------------------------------------------------------------------

enum class Interpolation { linear, step, cubic_spline };
enum class AnimatedProperty { translation, rotation, scale, weights };

struct AnimationSampler {
  int input = -1, output = -1;
  Interpolation interpolation = Interpolation::linear;
};

struct AnimationChannel {
  int sampler = -1, node = -1;
  AnimatedProperty property = AnimatedProperty::translation;
};

struct Animation {
  std::string name;  // empty: none
  std::vector<AnimationSampler> samplers;
  std::vector<AnimationChannel> channels;  // those that drive something we know
};

// ---- the whole -----------------------------------------------------------------------------------------------------

struct Document {
  ExtensionList extensions;
  std::vector<Buffer> buffers;
  std::vector<BufferView> views;
  std::vector<Accessor> accessors;
  std::vector<ImageSource> images;
  std::vector<Sampler> samplers;
  std::vector<Texture> textures;
  std::vector<Material> materials;   // TextureSlot::image indexes `images` above
  std::vector<bool> needs_tangents;  // by material: a normal map that only an ignored extension has
  std::vector<Mesh> meshes;
  std::vector<Node> nodes;
  std::vector<Skin> skins;
  std::vector<Animation> animations;
  std::vector<CameraDescription> cameras;  // to_world not set
  std::vector<PunctualLight> lights;       // position and direction not set
  std::vector<SceneRoot> scenes;
  int scene = -1;                              // -1: none chosen
  std::optional<Environment> environment;      // extras.heliograph; image indexes `images`
  std::optional<std::string> environment_uri;  // extras.heliograph
};

// Reads the whole JSON. All failures go to the root's diagnostics; the document is usable only when there were none.
Document read_document(const JsonObject& root);

// The parts of read_document, one per file. Each appends to `document` in the order given there; sizes of arrays that
// are read later are taken from the JSON.
void read_buffers(const JsonObject& root, Document& document);
void read_accessors(const JsonObject& root, Document& document);
void read_textures(const JsonObject& root, Document& document);
void read_materials(const JsonObject& root, Document& document);
void read_meshes(const JsonObject& root, Document& document);
void read_nodes(const JsonObject& root, Document& document);
void read_skins(const JsonObject& root, Document& document);
void read_scenes(const JsonObject& root, Document& document);
void read_animations(const JsonObject& root, Document& document);
void read_cameras(const JsonObject& root, Document& document);
void read_lights(const JsonObject& root, Document& document);

// Accessors of indices and matrices are packed: a byteStride of their view is a failure unless it says the same.
void check_no_stride(const Document& document, const Accessor& accessor, const std::string& place, const char* what,
                     Diagnostics& diagnostics);

// Rules between objects, checked when every object has been read.
void check_consistency(const Document& document, Diagnostics& diagnostics);

}  // namespace helio::gltf
