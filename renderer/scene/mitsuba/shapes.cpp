#include "renderer/scene/mitsuba/shapes.h"

#include <algorithm>

#include "renderer/scene/description/material_slots.h"
#include "renderer/scene/mitsuba/bsdfs.h"
#include "renderer/scene/mitsuba/meshes.h"
#include "renderer/scene/mitsuba/primitives.h"
#include "renderer/scene/mitsuba/textures.h"
#include "renderer/scene/mitsuba/transform.h"

namespace helio::mitsuba {

namespace {

constexpr const char* kShapes = "rectangle, cube, sphere, disk, cylinder, obj, ply, serialized, shapegroup, instance";

bool is_mesh_file(const std::string& type) {
  return type == "obj" || type == "ply" || type == "serialized";
}

// Flat shading: every triangle its own vertices would do; without normals our meshes are flat already. As in Mitsuba
// 3.9.1 the normals of the file tell the front; without them the triangles as they are placed do, so that mirroring
// turns it.
void set_shading(const Plugin& plugin, bool mirrored, TriangleMesh& mesh) {
  const bool flat = plugin.boolean("face_normals", false);
  if (flat) mesh.normals.clear();
  const bool own_normals = !mesh.normals.empty();
  if (!flat && !own_normals) add_vertex_normals(mesh);
  if (mirrored && !own_normals) flip(mesh);
}

// Of a shape that shines.
void warn_about_opacity(const Plugin& plugin, const Material& m) {
  if (m.alpha_mode == AlphaMode::opaque || (m.base_alpha == 1 && !m.opacity_texture.present())) return;
  plugin.warn(m.base_alpha > 0 ? "shines by the opacity of its bsdf, where Mitsuba 3 has its emission in full"
                               : "does not shine, as its bsdf lets all light pass; in Mitsuba 3 it does");
}

}  // namespace

void ShapeReader::read(const Element& element) {
  const Plugin plugin(element, context_.document, context_.diagnostics);
  if (plugin.type() == "shapegroup") return;
  if (plugin.type() == "instance") return read_instance(plugin);
  add_instance(plugin, read_object(element));
}

void ShapeReader::add_instance(const Plugin& plugin, const Placed& placed) {
  if (placed.object < 0) return;
  const Object& object = context_.scene.objects[std::size_t(placed.object)];
  if (Status s = context_.budget.reserve(sizeof(Instance) + object.name.size(), plugin.place()); !s.ok())
    return context_.diagnostics.fail(plugin.place(), s.error());
  context_.scene.instances.push_back({object.name, placed.object, placed.to_world});
}

ShapeReader::Placed ShapeReader::read_object(const Element& element) {
  const Plugin plugin(element, context_.document, context_.diagnostics);
  Placed placed;
  placed.to_world = plugin.transform("to_world");
  plugin.number("silhouette_sampling_weight", 1, {0, 1e30});  // of derivatives, of which there are none
  Object object;
  object.name = element.id.empty() ? plugin.type() : element.id;
  const Material material = read_material(plugin);
  const int index = int(context_.scene.materials.size());
  fill(plugin, material, object, placed.to_world);
  check_attribute(plugin, object);
  check_coordinates(plugin, material, object);
  if (object.meshes.empty() && object.spheres.empty()) return placed;
  for (TriangleMesh& mesh : object.meshes) mesh.material = index;
  for (Sphere& sphere : object.spheres) sphere.material = index;
  context_.scene.materials.push_back(material);
  context_.scene.objects.push_back(std::move(object));
  placed.object = int(context_.scene.objects.size()) - 1;
  return placed;
}

// The attribute of the mesh that the shape's bsdf asks for; empty: none.
std::string ShapeReader::attribute_of(const Plugin& plugin) const {
  const std::vector<const Element*> bsdfs = plugin.children("bsdf");
  const auto found = bsdfs.empty() ? context_.attributes.end() : context_.attributes.find(bsdfs.front());
  return found == context_.attributes.end() ? "" : found->second;
}

void ShapeReader::check_attribute(const Plugin& plugin, const Object& object) {
  const std::string attribute = attribute_of(plugin);
  const auto colored = [](const TriangleMesh& mesh) { return !mesh.colors.empty(); };
  if (attribute.empty() || (!object.meshes.empty() && std::all_of(object.meshes.begin(), object.meshes.end(), colored)))
    return;
  plugin.fail("has no attribute " + attribute +
              " (of the vertices or faces of a PLY file, with 1 or 3 values), which its bsdf names");
}

Material ShapeReader::read_material(const Plugin& plugin) {
  const std::vector<const Element*> bsdfs = plugin.children("bsdf"), emitters = plugin.children("emitter");
  if (bsdfs.size() > 1) plugin.fail("has " + std::to_string(bsdfs.size()) + " bsdfs, allowed: 1");
  if (emitters.size() > 1) plugin.fail("has " + std::to_string(emitters.size()) + " emitters, allowed: 1");
  for (const char* medium : {"interior", "exterior"})
    if (plugin.has(medium))
      plugin.fail(std::string("has an ") + medium + " medium, which is not supported", ErrorCode::unimplemented);
  Material material = !bsdfs.empty()     ? read_bsdf(*bsdfs.front(), context_)
                      : emitters.empty() ? default_material()
                                         : lamp_material();
  if (emitters.empty()) return material;
  const Plugin emitter = plugin.other(*emitters.front());
  if (emitter.type() != "area") {
    emitter.fail("of a shape is not supported; allowed: area", ErrorCode::unimplemented);
    return material;
  }
  emitter.number("sampling_weight", 1, {0, 1e30});
  const ColorOrTexture radiance = read_color(emitter, "radiance", Rgb(1, 1, 1), SpectrumUse::emission, context_);
  material.emission = radiance.color;
  material.emission_texture = radiance.texture;
  warn_about_opacity(plugin, material);
  return material;
}

template <class Has>
bool ShapeReader::any_part(const Material& m, const Has& has) const {
  if (has(m)) return true;
  if (m.model != MaterialModel::blend) return false;
  return any_part(context_.scene.materials[std::size_t(m.blend.first)], has) ||
         any_part(context_.scene.materials[std::size_t(m.blend.second)], has);
}

bool ShapeReader::is_bumped(const Material& material) const {
  return any_part(material, [](const Material& m) { return m.bump_texture.present(); });
}

bool ShapeReader::has_front(const Material& material) const {
  return any_part(material, [](const Material& m) {
    return m.one_sided || m.transmission > 0 || m.numbers.transmission.present() || m.bump_texture.present() ||
           m.normal_texture.present() || (m.model == MaterialModel::blend && m.blend.by_side);
  });
}

void ShapeReader::check_coordinates(const Plugin& plugin, const Material& material, const Object& object) const {
  const bool bare = std::any_of(object.meshes.begin(), object.meshes.end(),
                                [](const TriangleMesh& mesh) { return mesh.texcoords[0].empty(); });
  if (bare && any_part(material, [](const Material& m) { return has_any_texture(m); }))
    plugin.warn(
        "has textures but no texture coordinates: all of it shows what they have at (0, 0), where Mitsuba 3 gives "
        "every triangle coordinates of its own");
}

void ShapeReader::fill(const Plugin& plugin, const Material& material, Object& object, M44d& to_world) {
  const std::string& type = plugin.type();
  if (type == "sphere") return read_sphere(plugin, material, object, to_world);
  TriangleMesh mesh;
  if (type == "rectangle") {
    mesh = rectangle_mesh();
  } else if (type == "cube") {
    mesh = cube_mesh();
  } else if (type == "disk") {
    mesh = disk_mesh(is_bumped(material) ? kBumpedRings : 1);
  } else if (type == "cylinder") {
    const V3d p0 = plugin.vector("p0", {0, 0, 0}), p1 = plugin.vector("p1", {0, 0, 1});
    const double radius = plugin.number("radius", 1, {0, 1e12, true});
    if (!(length(p1 - p0) > 0)) return plugin.fail("has p0 equal to p1");
    mesh = cylinder_mesh(p0, p1, radius);
  } else if (is_mesh_file(type)) {
    read_mesh_file(plugin, mirrors(to_world), mesh);
  } else {
    return plugin.fail(std::string("is not supported; shapes that are: ") + kShapes, ErrorCode::unimplemented);
  }
  if (mesh.indices.empty()) return;
  if (plugin.boolean("flip_normals", false)) flip(mesh);
  if (is_mesh_file(type)) {
    object.meshes.push_back(std::move(mesh));
  } else {
    keep_primitive(plugin, std::move(mesh), object);
  }
}

// One at a time its size is no matter; a short file may name many.
void ShapeReader::keep_primitive(const Plugin& plugin, TriangleMesh mesh, Object& object) {
  const std::uint64_t bytes = mesh.positions.size() * sizeof(V3f) + mesh.normals.size() * sizeof(V3f) +
                              mesh.texcoords[0].size() * sizeof(V2f) + mesh.indices.size() * sizeof(std::uint32_t);
  if (Status s = context_.budget.reserve(bytes, plugin.place()); !s.ok())
    return context_.diagnostics.fail(plugin.place(), s.error());
  object.meshes.push_back(std::move(mesh));
}

void ShapeReader::read_mesh_file(const Plugin& plugin, bool mirrored, TriangleMesh& mesh) {
  Result<FoundFile> file = find_file(context_.document, context_.source, plugin.text("filename", ""), context_.budget);
  if (!file.ok()) return context_.diagnostics.fail(plugin.place(), file.error());
  const std::string& type = plugin.type();
  std::vector<V4f> face_colors;
  Result<TriangleMesh> parsed =
      type == "obj"   ? parse_obj(file->bytes, context_.budget)
      : type == "ply" ? parse_ply(file->bytes, context_.budget, attribute_of(plugin), &face_colors)
                      : parse_serialized(file->bytes, plugin.integer("shape_index", 0, 0, 1 << 30), context_.budget);
  const auto refuse = [&](Error error) {
    error.where = file->path;
    context_.diagnostics.fail(plugin.place(), error);
  };
  if (!parsed.ok()) return refuse(parsed.error());
  if (Status s = check_mesh(*parsed, context_.budget); !s.ok()) return refuse(s.error());
  mesh = std::move(*parsed);
  // Texture coordinates of OBJ files grow upwards.
  if (plugin.boolean("flip_tex_coords", type == "obj"))
    for (V2f& uv : mesh.texcoords[0]) uv.y = 1 - uv.y;
  set_shading(plugin, mirrored, mesh);
  if (face_colors.empty()) return;
  if (Status s = color_faces(mesh, face_colors, context_.budget); !s.ok()) refuse(s.error());
}

// Our spheres have the pole of their texture coordinates on y, Mitsuba's on z: one that is not the same all
// around is placed in a space of its own, d = (y, z, -x) of Mitsuba's.
void ShapeReader::read_sphere(const Plugin& plugin, const Material& material, Object& object, M44d& to_world) {
  const V3d center = plugin.vector("center", {0, 0, 0});
  const double radius = plugin.number("radius", 1, {0, 1e12, true});
  // Ours face outwards; those of Mitsuba 3.9.1 turn inside out where they are mirrored.
  const bool flipped = plugin.boolean("flip_normals", false) != mirrors(to_world);
  const bool shines = luminance(material.emission) > 0;
  if (flipped && (shines || has_front(material))) {
    TriangleMesh mesh = sphere_mesh(center, radius, shines ? kLampSegments : kSegments);
    flip(mesh);
    return keep_primitive(plugin, std::move(mesh), object);
  }
  if (!has_orientation(material)) {
    object.spheres.push_back({V3f(center), float(radius), 0});
    return;
  }
  object.spheres.push_back({V3f(0, 0, 0), float(radius), 0});
  const M44d turned(0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 0, center.x, center.y, center.z, 1);
  to_world = turned * to_world;
}

void ShapeReader::read_instance(const Plugin& plugin) {
  const std::vector<const Element*> shapes = plugin.children("shape");
  if (shapes.size() != 1 || shapes.front()->type != "shapegroup") return plugin.fail("needs one <ref> to a shapegroup");
  const auto [found, added] = groups_.try_emplace(shapes.front());
  if (added) {
    const Plugin group = plugin.other(*shapes.front());
    for (const Element* member : group.children("shape")) {
      if (context_.diagnostics.crowded()) return;
      if (member->type == "instance" || member->type == "shapegroup")
        group.other(*member).fail("inside of a shapegroup is not allowed");
      else
        found->second.push_back(read_object(*member));
    }
  }
  const M44d to_world = plugin.transform("to_world");
  for (const Placed& member : found->second) add_instance(plugin, {member.object, member.to_world * to_world});
}

}  // namespace helio::mitsuba
