#include "renderer/scene/mitsuba/sensors.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "renderer/scene/description/default_camera.h"
#include "renderer/scene/mitsuba/fov.h"
#include "renderer/scene/mitsuba/transform.h"

namespace helio::mitsuba {

namespace {

constexpr double kNearestFocus = 1e-12, kFarthestFocus = 1e12;
// Scales apart by less are rounded numbers of a file.
constexpr double kAlike = 1e-4;

struct FilmSize {
  // Mitsuba's defaults.
  int width = 768, height = 576;
  PixelRect crop;  // empty: all of it
  PixelFilter filter{PixelFilterKind::gaussian, default_pixel_filter_scale(PixelFilterKind::gaussian)};
  double aspect() const { return double(width) / height; }
};

FilmSize read_film(const Plugin& sensor, LoadContext& context) {
  FilmSize size;
  const std::vector<const Element*> films = sensor.children("film");
  if (films.empty()) return size;
  const Plugin film = sensor.other(*films.front());
  size.width = film.integer("width", size.width, 1, 1 << 20);
  size.height = film.integer("height", size.height, 1, 1 << 20);
  for (const char* key : {"pixel_format", "component_format", "file_format"}) film.text(key, "");
  for (const char* key : {"banner", "compensate", "attach_log", "high_quality_edges"}) film.boolean(key, false);
  const int left = film.integer("crop_offset_x", 0, 0, size.width - 1);
  const int top = film.integer("crop_offset_y", 0, 0, size.height - 1);
  const int wide = film.integer("crop_width", size.width - left, 1, size.width - left);
  const int high = film.integer("crop_height", size.height - top, 1, size.height - top);
  if (wide < size.width || high < size.height) size.crop = {left, top, left + wide, top + high};
  for (const Element* filter : film.children("rfilter")) {
    const Plugin p = film.other(*filter);
    if (filter->type == "tent") {
      size.filter = {PixelFilterKind::tent, p.number("radius", 1, {0, kMaxPixelFilterScale, true})};
    } else if (filter->type == "gaussian") {
      size.filter = {PixelFilterKind::gaussian, p.number("stddev", 0.5, {0, kMaxPixelFilterScale, true})};
    } else if (filter->type == "box") {
      size.filter = PixelFilter{};
      // Of 0.5 and 0.6; a box of any other size stays unread.
      for (const Element& child : filter->children)
        if (child.name == "radius" && parse_numbers(child.attribute("value")) == std::vector<double>{0.5})
          p.number("radius", 0.5);
    } else {
      for (const char* key : {"radius", "lobes", "B", "C"}) p.number(key, 0);
      size.filter = PixelFilter{};
      film.warn("asks for the reconstruction filter " + filter->type + ": pixels are box-filtered");
    }
  }
  if (film.boolean("sample_border", false) && size.filter.kind != PixelFilterKind::box)
    context.diagnostics.notice(film.place() + ": " + film.label() +
                               " has sample_border: here pixels along the edges are means over that part of their "
                               "filter that lies on the film");
  context.diagnostics.notice(fmt::format("the file's film has {} x {} pixels", size.width, size.height));
  return size;
}

struct Depths {
  double nearest = 0, farthest = 0;
};

// Between which the box may be seen; a perspective camera inside of it has 0 as the nearest.
Depths depths_of(const Box3d& box, const CameraDescription& camera) {
  const M44d& m = camera.to_world;
  const V3d eye(m[3][0], m[3][1], m[3][2]), axis = normalize(V3d(-m[2][0], -m[2][1], -m[2][2]));
  Depths depths{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (int corner = 0; corner < 8; ++corner) {
    const V3d p(corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y,
                corner & 4 ? box.max.z : box.min.z);
    depths.nearest = std::min(depths.nearest, dot(p - eye, axis));
    depths.farthest = std::max(depths.farthest, dot(p - eye, axis));
  }
  if (camera.projection == Projection::orthographic) return depths;
  // A floor below the camera has parts at depth 0 that no picture shows: what is seen at a depth lies at most so many
  // times as far away.
  const double high = std::tan(camera.vertical_fov / 2), wide = high * camera.aspect;
  V3d closest;
  for (int c = 0; c < 3; ++c) closest[c] = std::clamp(eye[c], box.min[c], box.max[c]);
  depths.nearest = std::max(depths.nearest, length(closest - eye) / std::sqrt(1 + high * high + wide * wide));
  return depths;
}

}  // namespace

void report_clipping(LoadContext& context) {
  if (context.clips.empty()) return;
  constexpr std::size_t kMostLooks = 10'000'000;  // at a shape, about a second of them
  const std::vector<Box3d> boxes = instance_bounds(context.scene);
  const std::size_t sensors = std::max<std::size_t>(1, kMostLooks / std::max<std::size_t>(1, boxes.size()));
  if (sensors < context.clips.size())
    context.diagnostics.notice(
        fmt::format("near_clip and far_clip of {} sensors beyond the first {} are not looked at: too many shapes",
                    context.clips.size() - sensors, sensors));
  for (const ClipPlanes& clip : std::span(context.clips).first(std::min(sensors, context.clips.size()))) {
    const CameraDescription& camera = context.scene.cameras[clip.camera];
    bool near_hides = false, far_hides = false;
    for (const Box3d& box : boxes) {
      if (near_hides && far_hides) break;
      if (box.isEmpty()) continue;
      const Depths depths = depths_of(box, camera);
      near_hides |= clip.near_clip && depths.nearest < *clip.near_clip && depths.farthest > 0;
      far_hides |= depths.farthest > clip.far_clip;
    }
    if (near_hides)
      context.diagnostics.notice(
          fmt::format("{} has near_clip {}: here shapes closer than that are seen", clip.sensor, *clip.near_clip));
    if (far_hides)
      context.diagnostics.notice(
          fmt::format("{} has far_clip {}: here shapes beyond it are seen", clip.sensor, clip.far_clip));
  }
}

void read_sensor(const Element& element, LoadContext& context) {
  const Plugin plugin(element, context.document, context.diagnostics);
  const std::string& type = plugin.type();
  if (type != "perspective" && type != "thinlens" && type != "orthographic")
    return plugin.fail("is not supported; sensors that are: perspective, thinlens, orthographic",
                       ErrorCode::unimplemented);
  const FilmSize film = read_film(plugin, context);
  for (const Element* sampler : plugin.children("sampler")) {
    const Plugin p = plugin.other(*sampler);
    p.number("sample_count", 4);
    p.number("seed", 0);
    p.boolean("jitter", true);
  }
  CameraDescription camera;
  camera.name = element.id.empty() ? type : element.id;
  camera.aspect = film.aspect();
  camera.width = film.width;
  camera.height = film.height;
  camera.crop = film.crop;
  camera.filter = film.filter;
  const M44d to_world = plugin.transform("to_world");
  if (mirrors(to_world)) plugin.warn("has a transform that mirrors: the picture is not mirrored");
  camera.to_world = camera_to_world(to_world);
  ClipPlanes clip;
  clip.sensor = plugin.place() + ": " + plugin.label();
  clip.camera = context.scene.cameras.size();
  if (plugin.has("near_clip")) clip.near_clip = plugin.number("near_clip", 1e-2, {0, 1e30});
  clip.far_clip = plugin.number("far_clip", 1e4, {0, 1e30});
  context.clips.push_back(clip);
  for (const char* key : {"shutter_open", "shutter_close"}) plugin.number(key, 0);  // nothing moves
  for (const char* key : {"principal_point_offset_x", "principal_point_offset_y"})
    if (plugin.number(key, 0) != 0)
      plugin.fail(std::string("has ") + key + " other than 0, which is not supported", ErrorCode::unimplemented);
  if (type == "orthographic") {
    camera.projection = Projection::orthographic;
    // The film is 2 wide, before the transform's scale along x.
    const double scale = length(V3d(to_world[0][0], to_world[0][1], to_world[0][2]));
    const double scale_y = length(V3d(to_world[1][0], to_world[1][1], to_world[1][2]));
    camera.half_height = scale / film.aspect();
    if (!(camera.half_height > 0))
      plugin.fail("has a transform without extent along x");
    else if (!(std::abs(scale_y / scale - 1) <= kAlike))
      plugin.fail(fmt::format("has a transform that scales x by {} and y by {}, allowed: both alike", scale, scale_y),
                  ErrorCode::unimplemented);
  } else {
    camera.vertical_fov = vertical_fov(plugin, film.aspect());
    // Mitsuba's default is the far plane.
    const double focus = plugin.number("focus_distance", std::clamp(clip.far_clip, kNearestFocus, kFarthestFocus),
                                       {0, kFarthestFocus, true});
    if (type == "thinlens") {
      camera.lens_radius = plugin.number("aperture_radius", 0, {0, 1e12});
      camera.focus_distance = focus;
    }
  }
  context.scene.cameras.push_back(camera);
}

}  // namespace helio::mitsuba
