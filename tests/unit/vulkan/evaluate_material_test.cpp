// Materials at hits on a device against evaluate_material(): textures, vertex colours, numbers, maps, blends, on
// meshes, spheres and instances; with them the shading normal and the emission.
//
// Rule for the tolerances: texels are in [0, 1], and so is what the device and the host make of them, to 2e-5. A height
// map has steps in its slope at the centres of texels, and a mapped normal may lie in the plane that it must not cross:
// so many of the hits may disagree as kOnBorders says, because rounding decides there.
#include <gtest/gtest.h>

#include <helio_shaders/material_queries_comp.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "renderer/trace/bsdf/bsdf_blend.h"
#include "renderer/trace/scene/surface.h"
#include "renderer/vulkan/scene/geometry_tables.h"
#include "renderer/vulkan/scene/material_tables.h"
#include "renderer/vulkan/scene/texture_tables.h"
#include "renderer/vulkan/shaders/tables/scene.h"
#include "tests/support/random.h"
#include "tests/support/test_scenes.h"
#include "tests/unit/vulkan/material_queries.h"
#include "tests/unit/vulkan/scene_queries.h"
#include "tests/unit/vulkan/test_device.h"

namespace helio::test {
namespace {

using vulkan::LobeParams;
using vulkan::MaterialAnswer;
using vulkan::MaterialQuery;

constexpr float kTolerance = 2e-5f;
constexpr double kOnBorders = 2e-3;
constexpr int kRays = 300;  // at a shape

// ---- a scene of all materials
// -----------------------------------------------------------------------------------------

Image random_image(Random& random, int width, int height, int channels) {
  Image image;
  image.width = width;
  image.height = height;
  image.channels = channels;
  for (int i = 0; i < width * height * channels; ++i) image.texels.push_back(std::uint8_t(random.next_u32() >> 24));
  return image;
}

class Textures {
 public:
  Textures(SceneDescription& scene, std::uint64_t seed) : random_(seed) {
    scene.images.push_back(random_image(random_, 5, 4, 4));
    scene.images.push_back(random_image(random_, 3, 7, 3));
    scene.images.push_back(random_image(random_, 8, 8, 1));
  }

  // Another image, encoding, set and wrap with every call.
  TextureSlot next() {
    TextureSlot slot;
    slot.image = int(random_.next_u32() % 3);
    slot.texcoord = int(random_.next_u32() % 2);
    slot.wrap_u = WrapMode(random_.next_u32() % 3);
    slot.wrap_v = WrapMode(random_.next_u32() % 3);
    slot.encoding = TexelEncoding(random_.next_u32() % 2);
    slot.uv_transform = {1.3f, 0.2f, 0.1f, -0.3f, 0.9f, 0.4f};
    return slot;
  }

 private:
  Random random_;
};

std::vector<Material> materials_with(Textures& textures) {
  std::vector<Material> list;
  const auto add = [&](MaterialModel model) -> Material& {
    Material& m = list.emplace_back();
    m.model = model;
    m.base_color = {0.9f, 0.7f, 0.5f};
    return m;
  };

  Material& gltf = add(MaterialModel::metallic_roughness);
  gltf.base_color_texture = textures.next();
  gltf.metallic_roughness_texture = textures.next();
  gltf.specular_texture = textures.next();
  gltf.specular_color_texture = textures.next();
  gltf.normal_texture = textures.next();
  gltf.normal_scale = 0.8f;
  gltf.emission = {1, 2, 3};
  gltf.emission_texture = textures.next();
  gltf.roughness = 0.8f;

  Material& clear = add(MaterialModel::metallic_roughness);
  clear.metallic = 0.2f;
  clear.transmission = 0.9f;
  clear.transmission_texture = textures.next();
  clear.thickness = 1;
  clear.bump_texture = textures.next();
  clear.bump_scale = 0.1f;

  Material& glossy = add(MaterialModel::specular_glossiness);
  glossy.specular_glossiness_f0 = {0.5f, 0.8f, 1};
  glossy.glossiness = 0.7f;
  glossy.specular_glossiness_texture = textures.next();
  glossy.double_sided = true;
  glossy.emission = {1, 1, 1};

  Material& unlit = add(MaterialModel::unlit);
  unlit.base_color_texture = textures.next();

  Material& brushed = add(MaterialModel::conductor);
  brushed.distribution = MicrofacetDistribution::beckmann;
  brushed.numbers.roughness = textures.next();
  brushed.numbers.roughness_across = textures.next();
  brushed.one_sided = true;

  Material& half_brushed = add(MaterialModel::conductor);
  half_brushed.roughness = 0.5f;
  half_brushed.roughness_across = 0.2f;
  half_brushed.numbers.roughness = textures.next();

  Material& plain_brushed = add(MaterialModel::conductor);
  plain_brushed.roughness = 0.5f;
  plain_brushed.roughness_across = 0.2f;

  Material& principled = add(MaterialModel::principled);
  principled.base_color_texture = textures.next();
  principled.metallic = 0.8f;
  principled.roughness = 0.9f;
  principled.principled = {0.9f, 0.8f, 0.7f, 0.6f, 0.5f, 0.4f, 0.3f};
  principled.numbers.roughness = textures.next();
  principled.numbers.metallic = textures.next();
  principled.numbers.transmission = textures.next();
  principled.transmission = 0.5f;
  principled.thickness = 1;
  principled.numbers.anisotropic = textures.next();
  principled.numbers.spec_tint = textures.next();
  principled.numbers.sheen = textures.next();
  principled.numbers.sheen_tint = textures.next();
  principled.numbers.flatness = textures.next();
  principled.numbers.clearcoat = textures.next();
  principled.numbers.clearcoat_gloss = textures.next();

  Material& own_frame = add(MaterialModel::conductor);
  own_frame.normal_texture = textures.next();
  own_frame.map_rule = MapRule::own_frame;
  own_frame.map_shadowing = true;
  own_frame.roughness_across = 0.3f;

  Material& mirrored = add(MaterialModel::plastic);
  mirrored.roughness = 0;
  mirrored.base_color_texture = textures.next();
  mirrored.bump_texture = textures.next();
  mirrored.bump_scale = 0.2f;
  mirrored.map_rule = MapRule::own_frame_unflipped;
  mirrored.map_mirrored = true;

  Material& own_bump = add(MaterialModel::pane);
  own_bump.bump_texture = textures.next();
  own_bump.bump_scale = -0.2f;
  own_bump.map_rule = MapRule::own_frame;

  const int parts = int(list.size());
  Material& blend = add(MaterialModel::blend);
  blend.blend.first = 8;
  blend.blend.second = 4;
  blend.blend.weight = 0.8f;
  blend.blend.weight_texture = textures.next();
  blend.normal_texture = textures.next();
  blend.map_rule = MapRule::own_frame;

  Material& sides = add(MaterialModel::blend);
  sides.blend.first = 4;
  sides.blend.second = 9;
  sides.blend.by_side = true;

  Material& even = add(MaterialModel::blend);
  even.blend.first = 7;
  even.blend.second = 2;
  even.blend.weight = 0.3f;
  EXPECT_EQ(parts, 11);
  return list;
}

// A bumpy patch around the origin, of radius about 1; `full`: with all vertex attributes.
TriangleMesh patch(Random& random, int material, bool full) {
  constexpr int kSide = 4;
  const auto jitter = [&](float by) { return by * (random.next_float() - 0.5f); };
  TriangleMesh mesh;
  mesh.material = material;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const float u = float(x) / (kSide - 1), v = float(y) / (kSide - 1);
      mesh.positions.push_back({2 * u - 1 + jitter(0.2f), jitter(0.4f), 2 * v - 1 + jitter(0.2f)});
      mesh.texcoords[0].push_back({u + jitter(0.1f), v + jitter(0.1f)});
      if (!full) continue;
      mesh.texcoords[1].push_back({2 * v + jitter(0.1f), 1 - u + jitter(0.1f)});
      mesh.normals.push_back(V3f(jitter(1), 1, jitter(1)).normalized());
      const V3f tangent = V3f(1, jitter(0.5f), jitter(0.5f)).normalized();
      mesh.tangents.push_back({tangent.x, tangent.y, tangent.z, material % 2 == 0 ? 1.0f : -1.0f});
      mesh.colors.push_back({random.next_float(), random.next_float(), random.next_float(), 1});
    }
  }
  for (std::uint32_t y = 0; y + 1 < kSide; ++y) {
    for (std::uint32_t x = 0; x + 1 < kSide; ++x) {
      const std::uint32_t i = y * kSide + x;
      for (const std::uint32_t k : {i, i + kSide, i + 1, i + 1, i + kSide, i + kSide + 1}) mesh.indices.push_back(k);
    }
  }
  return mesh;
}

struct Shapes {
  std::shared_ptr<const RenderScene> scene;
  std::vector<V3f> centers;
};

// Each material on five shapes in a row: two meshes, a sphere, and two instances of a mesh and a sphere, the second
// mirrored.
Shapes all_shapes() {
  constexpr float kStep = 4;
  SceneDescription scene;
  Textures textures(scene, 11);
  scene.materials = materials_with(textures);
  Shapes shapes;
  Random random(12);
  for (int i = 0; i < int(scene.materials.size()); ++i) {
    const auto place = [&](int column) {
      const V3f center(kStep * float(column), 0, kStep * float(i));
      shapes.centers.push_back(center);
      M44d to_world;
      to_world.translate(V3d(center));
      return to_world;
    };
    add_mesh(scene, patch(random, i, true), place(0));
    add_mesh(scene, patch(random, i, false), place(1));
    Object ball;
    ball.spheres.push_back({V3f(0), 1, i});
    add_instance(scene, add_object(scene, ball), place(2));
    Object both;
    both.meshes.push_back(patch(random, i, true));
    both.spheres.push_back({V3f(0.5f, 1, 0), 0.5f, i});
    const int object = add_object(scene, std::move(both));
    M44d turned, squeezed;
    turned.rotate(V3d(0.3, 0.7, 0.2));
    squeezed.scale(V3d(-0.8, 1.1, 0.9));
    add_instance(scene, object, turned * place(3));
    add_instance(scene, object, squeezed * place(4));
  }
  shapes.scene = build(std::move(scene));
  const V3f origin(shapes.scene->origin());
  for (V3f& center : shapes.centers) center -= origin;
  return shapes;
}

std::vector<MaterialQuery> hits_on(const Shapes& shapes) {
  const SceneData& data = shapes.scene->impl();
  Random random(13);
  std::vector<Ray> rays;
  std::vector<std::uint32_t> order;
  const auto around = [&](float radius) {
    return V3f(random.next_float() - 0.5f, random.next_float() - 0.5f, random.next_float() - 0.5f) * (2 * radius);
  };
  for (const V3f& center : shapes.centers) {
    for (int i = 0; i < kRays; ++i) {
      Ray ray;
      ray.origin = center + around(1) + V3f(0, i % 2 == 0 ? 3.0f : -3.0f, 0);
      ray.direction = (center + around(1) - ray.origin).normalized();
      ray.t_max = std::numeric_limits<float>::infinity();
      order.push_back(std::uint32_t(rays.size()));
      rays.push_back(ray);
    }
  }
  std::vector<Hit> hits(rays.size());
  data.accel->intersect(rays.data(), order.data(), rays.size(), hits.data(), RayOrder::scattered);
  std::vector<MaterialQuery> queries;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (hits[i].valid()) queries.push_back({rays[i], hits[i]});
  }
  return queries;
}

// ---- comparison
// -------------------------------------------------------------------------------------------------------

// The numbers in which two answers differ by more than the tolerance, by name.
class Disagreement {
 public:
  void check(const char* name, float host, float device) {
    const float d = std::fabs(host - device);
    if (d <= kTolerance * std::max(1.0f, std::fabs(host))) return;
    text_ << name << " " << host << " on the device " << device << "; ";
  }
  void check(const char* name, const V3f& host, const V3f& device) {
    for (int c = 0; c < 3; ++c) check(name, host[c], device[c]);
  }
  void check(const char* name, std::uint32_t host, std::uint32_t device) {
    if (host != device) text_ << name << " " << host << " on the device " << device << "; ";
  }
  void check_lobes(const LobeParams& host, const LobeParams& device) {
    check("model", host.model, device.model);
    check("distribution", host.distribution, device.distribution);
    check("thin", host.thin, device.thin);
    check("tinted_reflection", host.tinted_reflection, device.tinted_reflection);
    check("alpha", host.alpha, device.alpha);
    check("base_color", host.base_color, device.base_color);
    check("metallic", host.metallic, device.metallic);
    check("transmission", host.transmission, device.transmission);
    check("ior", host.ior, device.ior);
    check("specular", host.specular, device.specular);
    check("specular_color", host.specular_color, device.specular_color);
    check("f0", host.f0, device.f0);
    check("eta", host.eta, device.eta);
    check("k", host.k, device.k);
    check("alpha_along", host.alpha_along, device.alpha_along);
    check("alpha_across", host.alpha_across, device.alpha_across);
    check("along x", host.along.x, device.along.x);
    check("along y", host.along.y, device.along.y);
    check("anisotropic", host.principled.anisotropic, device.principled.anisotropic);
    check("spec_tint", host.principled.spec_tint, device.principled.spec_tint);
    check("sheen", host.principled.sheen, device.principled.sheen);
    check("sheen_tint", host.principled.sheen_tint, device.principled.sheen_tint);
    check("flatness", host.principled.flatness, device.principled.flatness);
    check("clearcoat", host.principled.clearcoat, device.principled.clearcoat);
    check("clearcoat_gloss", host.principled.clearcoat_gloss, device.principled.clearcoat_gloss);
  }
  void check_map(const SurfaceParams& host, std::uint32_t mapped, const V3f& normal, float alpha2) {
    check("mapped", std::uint32_t(host.mapped), mapped);
    if (!host.mapped) return;
    check("map_normal", host.map_normal, normal);
    check("map_alpha2", host.map_alpha2, alpha2);
  }

  std::string text() const { return text_.str(); }

 private:
  std::ostringstream text_;
};

std::string disagreement(const SceneData& data, const MaterialQuery& query, const MaterialAnswer& answer) {
  const V3f wo = -query.ray.direction;
  Surface surface = make_surface<true>(data, query.ray, query.hit);
  interpolate_normal(data, query.hit, wo, 0, surface);
  const SurfaceParams params = evaluate_material(data, query.hit, wo, 0, surface);
  const auto lobes_of = [](const SurfaceParams& p) { return make_lobe_params(p, vulkan::BsdfTables(), 0); };
  Disagreement d;
  d.check("shading_normal", surface.shading_normal, answer.shading_normal);
  if (surface.material->emissive) d.check("emission", surface_emission(data, query.hit, surface), answer.emission);
  d.check("model", std::uint32_t(params.model), answer.model);
  d.check("transmission", params.transmission, answer.transmission);
  d.check_map(params, answer.mapped, answer.map_normal, answer.map_alpha2);
  if (params.model != LobeModel::blend) {
    d.check_lobes(lobes_of(params), answer.first);
    d.check("mapped part", 0u, answer.first.mapped);
    d.check("weight", 0.0f, answer.weight);
    return d.text();
  }
  d.check("weight", params.blend->weight, answer.weight);
  const auto check_part = [&](const SurfaceParams& host, const LobeParams& device) {
    d.check_lobes(lobes_of(host), device);
    d.check_map(host, device.mapped, device.map_normal, device.map_alpha2);
  };
  check_part(params.blend->first, answer.first);
  check_part(params.blend->second, answer.second);
  return d.text();
}

class EvaluateMaterial : public DeviceTest {};

TEST_F(EvaluateMaterial, AgreesAtHitsOnAllMaterialsAndShapes) {
  const Shapes shapes = all_shapes();
  ASSERT_TRUE(shapes.scene);
  const SceneData& data = shapes.scene->impl();
  vulkan::Arena arena(device());
  vulkan::SceneGeometry geometry = vulkan::make_geometry(data);
  ASSERT_TRUE(vulkan::upload_meshes(geometry, arena).ok());
  ASSERT_TRUE(vulkan::upload_geometry(geometry, arena).ok());
  const vulkan::HostMaterials materials = vulkan::make_host_materials(data.description.materials, data.materials);
  const std::uint64_t before = arena.bytes();
  const auto placed = materials.place(arena);
  EXPECT_LE(arena.bytes() - before, materials.bytes());
  const auto textures = vulkan::make_host_textures(data.assets->images).place(arena);
  ASSERT_TRUE(placed.ok() && textures.ok());
  vulkan::SceneTables tables{};
  tables.geometry = geometry.tables;
  tables.materials = *placed;
  tables.textures = *textures;
  const auto scene = arena.upload_value(tables, "the scene");
  ASSERT_TRUE(scene.ok());

  const std::vector<MaterialQuery> queries = hits_on(shapes);
  const auto answers = run_scene_queries<MaterialAnswer>(device(), material_queries_comp, *scene, queries);
  ASSERT_TRUE(answers.ok()) << answers.error().to_string();
  std::vector<int> hits(data.materials.size()), on_borders(data.materials.size());
  std::vector<std::string> texts(data.materials.size());
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const std::uint32_t material = data.part(queries[i].hit).material;
    ++hits[material];
    const std::string text = disagreement(data, queries[i], (*answers)[i]);
    if (text.empty()) continue;
    if (++on_borders[material] <= 3) texts[material] += "\n" + text;
  }
  for (std::size_t m = 0; m < hits.size(); ++m) {
    EXPECT_GT(hits[m], 2 * kRays) << "material " << m;
    EXPECT_LE(on_borders[m], kOnBorders * hits[m]) << "material " << m << texts[m];
  }
}

}  // namespace
}  // namespace helio::test
