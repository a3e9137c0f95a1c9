// What a scene file says, as plain data: no BVH, no light tables, no pixels of a film.
//
// Loaders (one per format) fill a SceneDescription; the texture store decodes its images; trace/ builds the immutable
// RenderScene from it. Right-handed, y up, distances in the file's own unit, angles in radians. Transforms are double
// because node hierarchies may place small objects far from the origin; the scene is rebased once, at build.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "renderer/base/math.h"
#include "renderer/base/pixel_filter.h"

namespace helio {

// ---- images and textures -------------------------------------------------------------------------------------------

enum class TexelFormat : std::uint8_t { u8, u16, f16, f32 };

// Decoded pixels, row 0 on top, channels interleaved. Stored as decoded, without colour conversion: whether texels are
// sRGB-encoded is decided by the slot that uses them (see TextureSlot::encoding).
struct Image {
  std::string name;  // for messages: uri or "image 3"
  int width = 0, height = 0;
  int channels = 0;  // 1 (grey), 2 (grey, alpha), 3 (rgb) or 4 (rgba)
  TexelFormat format = TexelFormat::u8;
  std::vector<std::uint8_t> texels;  // width * height * channels * size of format

  std::size_t bytes() const { return texels.size(); }
};

enum class WrapMode : std::uint8_t { repeat, clamp, mirror };
enum class FilterMode : std::uint8_t { bilinear, nearest };
// The one place that says what a texel means: `srgb` texels are decoded to linear before filtering (alpha never is).
enum class TexelEncoding : std::uint8_t { linear, srgb };

// A use of an image by a material. image < 0: no texture, the factor alone counts.
struct TextureSlot {
  int image = -1;     // index into SceneDescription::images
  int texcoord = 0;   // index of the vertex attribute TEXCOORD_n
  WrapMode wrap_u = WrapMode::repeat, wrap_v = WrapMode::repeat;
  FilterMode filter = FilterMode::bilinear;
  TexelEncoding encoding = TexelEncoding::linear;
  // KHR_texture_transform: u' = m[0] u + m[1] v + m[2], v' = m[3] u + m[4] v + m[5].
  std::array<float, 6> uv_transform{1, 0, 0, 0, 1, 0};

  bool present() const { return image >= 0; }
  bool operator==(const TextureSlot&) const = default;
};

// ---- materials -----------------------------------------------------------------------------------------------------

enum class MaterialModel : std::uint8_t {
  metallic_roughness,   // glTF 2.0 appendix B, with transmission / specular / ior / volume
  specular_glossiness,  // KHR_materials_pbrSpecularGlossiness
  unlit,                // KHR_materials_unlit: emits its base colour, reflects nothing
  conductor,            // extras.heliograph: eta, k per channel, alpha
  plastic,              // Mitsuba: diffuse base under a dielectric interface, smooth or rough
  pane,                 // Mitsuba: a smooth sheet of glass with two sides, no refraction
  principled,           // Mitsuba: Burley's model, see PrincipledMaterial
  blend,                // Mitsuba: two materials mixed, see BlendMaterial
};
enum class AlphaMode : std::uint8_t { opaque, mask, blend };
// The anisotropic ones are what MaterialLayers::anisotropy, Material::roughness_across and PrincipledMaterial make of
// the others: no material names them.
enum class MicrofacetDistribution : std::uint8_t { ggx, beckmann, ggx_anisotropic, beckmann_anisotropic };

// KHR_materials_clearcoat, _sheen, _anisotropy, _iridescence and _diffuse_transmission: what may lie on or in the
// metallic-roughness model. All factors 0: nothing does.
struct MaterialLayers {
  float clearcoat = 0;            // [0, 1]; texture channel r
  float clearcoat_roughness = 0;  // perceptual, [0, 1]; texture channel g
  float clearcoat_normal_scale = 1;
  TextureSlot clearcoat_texture, clearcoat_roughness_texture;
  TextureSlot clearcoat_normal_texture;  // absent: the coat is smooth, whatever the base's normal map

  Rgb sheen_color{0, 0, 0};   // [0, 1]; texture rgb
  float sheen_roughness = 0;  // perceptual, [0, 1]; texture channel a
  TextureSlot sheen_color_texture, sheen_roughness_texture;

  float anisotropy = 0;           // [0, 1]; texture channel b
  float anisotropy_rotation = 0;  // radians, counter-clockwise from the tangent
  TextureSlot anisotropy_texture; // rg: direction in tangent space, from [0, 1] to [-1, 1]

  float iridescence = 0;                                                   // [0, 1]; texture channel r
  float iridescence_ior = 1.3f;                                            // of the film, >= 1
  float iridescence_thickness_min = 100, iridescence_thickness_max = 400;  // nm, >= 0; texture channel g mixes them
  TextureSlot iridescence_texture, iridescence_thickness_texture;

  float diffuse_transmission = 0;  // [0, 1], of the diffuse base; texture channel a
  Rgb diffuse_transmission_color{1, 1, 1};  // [0, 1]; texture rgb
  TextureSlot diffuse_transmission_texture, diffuse_transmission_color_texture;

  // Whether anything of it shows.
  bool any() const {
    return clearcoat > 0 || sheen_color != Rgb(0, 0, 0) || anisotropy > 0 || iridescence > 0 ||
           diffuse_transmission > 0;
  }
};

// What Mitsuba's "principled" has besides base_color, metallic, ior, transmission (its spec_trans) and roughness.
struct PrincipledMaterial {
  float anisotropic = 0;      // [0, 1]
  float spec_tint = 0;        // [0, 1]
  float sheen = 0;            // [0, 1]
  float sheen_tint = 0;       // [0, 1]
  float flatness = 0;         // [0, 1]
  float clearcoat = 0;        // [0, 1]
  float clearcoat_gloss = 0;  // [0, 1]
};

// Numbers of Mitsuba's materials that textures give: the luminance of the texel, clamped to [0, 1], times the number.
struct NumberTextures {
  // Microfacet alpha along and across the tangent in place of roughness squared; of principled the perceptual
  // roughness. Across absent: roughness_across where that is not below 0, else the same as along.
  TextureSlot roughness, roughness_across;
  TextureSlot metallic, transmission;  // of principled, as the rest
  TextureSlot anisotropic, spec_tint, sheen, sheen_tint, flatness, clearcoat, clearcoat_gloss;
};

// (1 - weight) first + weight second; or the first on the front and the second on the back.
struct BlendMaterial {
  int first = -1, second = -1;  // indices into SceneDescription::materials; maps of their normals only with their own
                                // frames (MapRule other than bend)
  float weight = 0.5f;          // [0, 1]
  TextureSlot weight_texture;   // luminance, times weight
  bool by_side = false;
};

// What a normal or bump map does. bend: it is the shading normal, bent where it would face away from the viewer or
// reflect below the surface. own_frame and own_frame_unflipped, Mitsuba's: only the scattering happens in the frame of
// the mapped normal, on spheres too (trace/scene/surface_map.h); own_frame turns a normal that faces away from the
// viewer by half a turn about the unmapped one.
enum class MapRule : std::uint8_t { bend, own_frame, own_frame_unflipped };

struct Material {
  std::string name;
  MaterialModel model = MaterialModel::metallic_roughness;

  Rgb base_color{1, 1, 1};  // diffuse colour for specular_glossiness; [0, 1]
  float base_alpha = 1;     // [0, 1]
  TextureSlot base_color_texture;  // rgb times base_color, a times base_alpha

  float metallic = 1;   // [0, 1]; texture channel b
  float roughness = 1;  // perceptual, [0, 1]; microfacet alpha = roughness^2; texture channel g
  TextureSlot metallic_roughness_texture;
  // conductor, and dielectrics of metallic_roughness: roughness across the tangent, `roughness` being that along it;
  // < 0: the same.
  float roughness_across = -1;

  // specular_glossiness: roughness above is unused, glossiness = 1 - perceptual roughness.
  Rgb specular_glossiness_f0{1, 1, 1};
  float glossiness = 1;
  TextureSlot specular_glossiness_texture;  // rgb: f0, a: glossiness

  // KHR_materials_specular
  float specular = 1;                  // texture channel a
  Rgb specular_color{1, 1, 1};         // texture rgb
  TextureSlot specular_texture, specular_color_texture;

  float ior = 1.5f;  // KHR_materials_ior; >= 1, or 0 for the specular-glossiness compatibility case (f0 = 1)

  float transmission = 0;  // KHR_materials_transmission; texture channel r
  TextureSlot transmission_texture;
  // KHR_materials_volume. thickness 0: thin wall (light passes unbent). > 0: the surface bounds a volume, refracts by
  // ior, and light inside is absorbed: transmittance attenuation_color^(distance / attenuation_distance).
  float thickness = 0;
  TextureSlot thickness_texture;  // channel g; a path tracer only asks whether the mesh is a volume
  Rgb attenuation_color{1, 1, 1};
  float attenuation_distance = std::numeric_limits<float>::infinity();

  Rgb emission{0, 0, 0};  // emissiveFactor x emissiveStrength: radiance, W / (sr m^2) per channel, >= 0
  TextureSlot emission_texture;

  TextureSlot normal_texture;  // tangent space, linear
  float normal_scale = 1;
  TextureSlot bump_texture;  // luminance: height along the normal; on meshes without normal_texture
  float bump_scale = 1;      // scene units per unit of it
  MapRule map_rule = MapRule::bend;
  bool map_shadowing = false;  // rules other than bend: the facets' shadowing term (Conty Estevez et al. 2019)
  bool map_mirrored = false;   // the same: on the back face the mapped normal is mirrored at the surface, not negated

  MaterialLayers layers;  // of metallic_roughness
  bool nonlinear = false;  // plastic: the base's colour shifts as light goes back and forth below the interface
  // metallic_roughness that transmits: specular_color is the colour of all that the interface reflects and takes
  // nothing from what passes, instead of f0's.
  bool tinted_reflection = false;
  PrincipledMaterial principled;
  NumberTextures numbers;
  BlendMaterial blend;

  AlphaMode alpha_mode = AlphaMode::opaque;
  float alpha_cutoff = 0.5f;
  TextureSlot opacity_texture;  // alpha channel; where present the only one that counts
  bool double_sided = false;  // false: emission leaves the front only; reflection works on both sides
  bool one_sided = false;     // Mitsuba: reflects on its front only, black from behind

  // extras.heliograph
  MicrofacetDistribution distribution = MicrofacetDistribution::ggx;
  Rgb conductor_eta{0.2f, 0.92f, 1.1f}, conductor_k{3.9f, 2.45f, 2.14f};  // model == conductor
};

// Whether a material keeps its inside apart from its outside: light can get in, and there is room for it.
inline bool bounds_volume(const Material& m) {
  const bool diffuse = m.model == MaterialModel::metallic_roughness && m.layers.diffuse_transmission > 0;
  return m.thickness > 0 && (m.transmission > 0 || diffuse);
}

// ---- geometry ------------------------------------------------------------------------------------------------------

inline constexpr int kMaxTexcoordSets = 4;

// Triangles with one material. Attribute arrays are empty or have one entry per vertex.
struct TriangleMesh {
  std::vector<V3f> positions;
  std::vector<V3f> normals;   // unit; empty: flat shading
  std::vector<V4f> tangents;  // xyz unit, w = +-1 handedness; empty: derived from texture coordinates when needed
  std::array<std::vector<V2f>, kMaxTexcoordSets> texcoords;
  std::vector<V4f> colors;    // linear rgba, multiplies base colour and alpha
  std::vector<std::uint32_t> indices;  // 3 per triangle, each < positions.size()
  int material = 0;

  std::size_t triangle_count() const { return indices.size() / 3; }
};

struct Sphere {
  V3f center{0, 0, 0};
  float radius = 1;  // > 0
  int material = 0;
};

// What a glTF mesh is: parts that move together. An Object is what is instanced.
struct Object {
  std::string name;
  std::vector<TriangleMesh> meshes;
  std::vector<Sphere> spheres;
};

struct Instance {
  std::string name;  // node name, or "node 7"
  int object = 0;
  M44d to_world;     // row vectors: p_world = p_local * to_world
  // Orientation for transforms of determinant 0 (a scale of 0 along one axis): true if they are the limit of transforms
  // that mirror, so that front faces are on the mirrored side. Otherwise the determinant decides.
  bool flat_mirrored = false;
};

// ---- lights, environment, cameras ----------------------------------------------------------------------------------

enum class PunctualKind : std::uint8_t { point, spot, directional, projector };

// From the inner cone to the outer one: KHR_lights_punctual's square of a ramp in the cosine, or Mitsuba's ramp in the
// angle.
enum class SpotFalloff : std::uint8_t { squared_cosine, linear_in_angle };

// What a projector shows where. Of a direction d from its position, in picture coordinates: u = 1/2 + across.d /
// depth.d, v = 1/2 + down.d / depth.d; nothing outside [0, 1]^2 and where depth.d <= 0. The three are independent,
// across and down of any length.
struct PictureProjection {
  V3d across{0.5, 0, 0}, down{0, -0.5, 0};
  V3d depth{0, 0, -1};  // unit
  TextureSlot picture;  // rgb times the light's intensity; absent: white
};

struct PunctualLight {
  std::string name;
  PunctualKind kind = PunctualKind::point;
  V3d position{0, 0, 0};
  V3d direction{0, 0, -1};  // unit, the way light travels (spot axis, directional, projector axis)
  // point, spot: radiant intensity, W / sr; directional: irradiance on a facing surface, W / m^2. projector: irradiance
  // at depth 1 (in the scene's unit) on surfaces whose normal is the axis: the same all over the picture.
  Rgb intensity{1, 1, 1};
  float range = std::numeric_limits<float>::infinity();  // KHR_lights_punctual "range": windowing distance
  float inner_cone_angle = 0, outer_cone_angle = kPi / 4;  // spot, half angles
  SpotFalloff falloff = SpotFalloff::squared_cosine;
  PictureProjection projection;  // projector
};

struct Environment {
  Rgb radiance{1, 1, 1};  // multiplies the map, or is the constant radiance
  int image = -1;         // latitude-longitude map, index into images; < 0: constant
  // Rotates map directions into the world. In map space +y is up and the centre column looks along +z: environment.h.
  M44d to_world;
};

enum class Projection : std::uint8_t { perspective, orthographic };

struct CameraDescription {
  std::string name;
  Projection projection = Projection::perspective;
  double vertical_fov = 0.8;        // perspective: full angle, (0, pi)
  double half_height = 1;           // orthographic: half of the view's height
  double aspect = 0;                // width / height written in the file; 0: none. Gives the default film size
  bool keeps_aspect = false;        // pictures of another aspect frame all that one of `aspect` would, and more
  int width = 0, height = 0;        // pixels that the file asks for; 0: none
  PixelRect crop;                   // of them, what the file wants rendered; empty: all
  std::optional<PixelFilter> filter;  // that the file asks for
  M44d to_world;                    // looks along -z, +y up; scale is ignored
  double lens_radius = 0;           // extras.heliograph; 0: pinhole
  double focus_distance = 1;
};

// What the file says of how it is to be rendered: defaults for whoever renders it. 0: nothing.
struct RenderHints {
  int max_segments = 0;   // PathSettings::max_segments, [1, 65535]
  int roulette_from = 0;  // PathSettings::roulette_from, [1, 65535]
};

// ---- the whole -----------------------------------------------------------------------------------------------------

struct LoadReport {
  std::vector<std::string> warnings;  // "optional extension X is ignored", ...
  std::vector<std::string> notices;   // "no light: constant environment of 1", ...
  std::vector<std::string> unread;    // keys that no loader looked at
  std::size_t slips = 0;  // of the warnings: broken rules of the format for which a strict load is refused
  std::size_t more_warnings = 0, more_notices = 0, more_unread = 0;  // lines beyond those that are kept
};

struct SceneDescription {
  std::string name;
  std::vector<std::string> animations;  // clips of the file that can be played, by name
  std::string animation;                // the one that is; empty: none
  std::vector<Image> images;
  std::vector<Material> materials;  // never empty after loading: meshes without one use a default appended last
  std::vector<Object> objects;
  std::vector<Instance> instances;
  std::vector<PunctualLight> lights;
  std::optional<Environment> environment;
  std::vector<CameraDescription> cameras;  // never empty after loading
  RenderHints hints;
  LoadReport report;
  // Bytes that this and what is built from it (BVH, light tables) may take together, the environment's map aside:
  // what its load was allowed (memory_budget.h).
  std::uint64_t memory_limit = std::numeric_limits<std::uint64_t>::max();
};

}  // namespace helio
