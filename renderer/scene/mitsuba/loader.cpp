#include "renderer/scene/mitsuba/loader.h"

#include <algorithm>
#include <string_view>

#include "renderer/scene/mitsuba/bsdfs.h"
#include "renderer/scene/mitsuba/emitters.h"
#include "renderer/scene/mitsuba/sensors.h"
#include "renderer/scene/mitsuba/shapes.h"

namespace helio {

namespace mitsuba {

namespace {

constexpr double kMostSegments = 65535;

void read_integrator(const Element& element, LoadContext& context) {
  const Plugin plugin(element, context.document, context.diagnostics);
  for (const Element* inner : plugin.children("integrator")) read_integrator(*inner, context);
  RenderHints& hints = context.scene.hints;
  const auto depth_of = [&](const char* key) {
    return int(std::clamp(plugin.number(key, -1, {-1, 1e9}), -1.0, kMostSegments));
  };
  if (plugin.has("rr_depth")) hints.roulette_from = std::max(depth_of("rr_depth"), 1);
  // How the work is cut and spread.
  for (const char* key :
       {"block_size", "samples_per_pass", "timeout", "emitter_samples", "bsdf_samples", "shading_samples"})
    plugin.number(key, 0);
  // Those that trace whole paths have no longest one unless they say so.
  const std::string& type = plugin.type();
  const bool endless = type == "path" || type == "volpath" || type == "volpathmis" || type == "ptracer";
  if (endless || plugin.has("max_depth")) {
    const int depth = depth_of("max_depth");
    if (depth == 0) plugin.warn("ends paths before they begin, in a black picture: here after 1 segment");
    hints.max_segments = depth < 0 ? int(kMostSegments) : std::max(depth, 1);
    context.diagnostics.notice(depth < 0
                                   ? "the file's integrator has no longest path"
                                   : "the file's integrator ends paths after " + std::to_string(depth) + " segments");
  }
  if (plugin.boolean("hide_emitters", false)) plugin.warn("hides emitters: here the camera sees them");
  if (type != "path" && type != "moment") plugin.warn("is not used: scenes are path-traced");
}

void read_scene(LoadContext& context, bool own_environment) {
  ShapeReader shapes(context);
  for (const Element& element : context.document.root.children) {
    if (context.diagnostics.crowded()) return;
    const std::string& tag = element.tag;
    if (tag == "shape")
      shapes.read(element);
    else if (tag == "emitter" && element.type != "area")  // those are for shapes to refer to
      read_emitter(element, own_environment, context);
    else if (tag == "sensor")
      read_sensor(element, context);
    else if (tag == "integrator")
      read_integrator(element, context);
    else if (tag != "bsdf" && tag != "texture" && tag != "spectrum" && tag != "rgb" && tag != "float" &&
             tag != "emitter")
      context.diagnostics.warn(element.place, "<" + tag + "> is ignored");
  }
}

}  // namespace
}  // namespace mitsuba

bool looks_like_mitsuba(std::span<const std::uint8_t> bytes, const std::string& path) {
  if (path.ends_with(".xml")) return true;
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && text[first] == '<';
}

Result<SceneDescription> load_mitsuba(std::span<const std::uint8_t> file, const std::string& path,
                                      const FileSource& source, const SceneLoadOptions& options, MemoryBudget& budget) {
  using namespace mitsuba;
  if (!options.animation.empty())
    return Error{ErrorCode::invalid_argument,
                 "there is no animation \"" + options.animation.substr(0, 60) + "\": Mitsuba scenes have none", path};
  Diagnostics diagnostics("");
  Document document;
  read_document(file, path, source, budget, diagnostics, document);
  if (diagnostics.failed()) return diagnostics.to_error();
  SceneDescription scene;
  scene.name = path;
  LoadContext context{document, source, budget, diagnostics, scene, {}, {}, {}, {}, {}};
  read_scene(context, options.environment.empty());
  report_clipping(context);
  if (diagnostics.failed()) return diagnostics.to_error();
  if (scene.materials.empty()) scene.materials.push_back(default_material());
  report_unread(document.root, diagnostics);
  scene.report = diagnostics.take_report();
  return scene;
}

}  // namespace helio
