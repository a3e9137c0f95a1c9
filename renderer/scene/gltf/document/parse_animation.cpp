// animations: samplers and the channels that drive something we know.
#include <set>

#include "renderer/scene/gltf/document/document.h"

namespace helio::gltf {

namespace {

AnimationSampler read_sampler(const JsonObject& object, const Document& document) {
  AnimationSampler sampler;
  object.only({"input", "output", "interpolation"});
  if (!object.require({"input", "output"})) return sampler;
  sampler.input = object.reference("input", document.accessors.size(), "accessors");
  sampler.output = object.reference("output", document.accessors.size(), "accessors");
  const std::string interpolation = object.string("interpolation", "LINEAR");
  if (interpolation == "STEP")
    sampler.interpolation = Interpolation::step;
  else if (interpolation == "CUBICSPLINE")
    sampler.interpolation = Interpolation::cubic_spline;
  else if (interpolation != "LINEAR")
    object.diagnostics().fail(object.place() / "interpolation",
                              "is \"" + interpolation + "\", allowed: LINEAR, STEP, CUBICSPLINE");
  if (sampler.input >= 0) {
    const Accessor& input = document.accessors[std::size_t(sampler.input)];
    if (input.type != ElementType::scalar || input.component != ComponentType::f32)
      object.diagnostics().fail(object.place() / "input", std::string("names an accessor of ") + name_of(input.type) +
                                                              " of " + name_of(input.component) +
                                                              ", allowed: SCALAR of FLOAT");
  }
  return sampler;
}

// KHR_animation_pointer is not implemented; what it says must still be well-formed.
void check_pointer(const JsonObject& target) {
  const JsonObject extension = target.extension("KHR_animation_pointer");
  if (!extension.exists()) return;
  extension.only({"pointer"});
  if (target.has("node")) target.diagnostics().fail(target.place() / "node", "must be absent beside a pointer");
  if (target.string("path") != "pointer")
    target.diagnostics().fail(target.place() / "path",
                              "is \"" + target.string("path") + "\", allowed beside a pointer: \"pointer\"");
  if (!extension.require("pointer")) return;
  const std::string pointer = extension.string("pointer");
  if (!pointer.empty() && pointer.front() != '/')
    extension.diagnostics().fail(extension.place() / "pointer", "is \"" + pointer + "\", expected a JSON pointer");
}

// Whether the channel moves anything. The sampler's output must fit the property: format and number of elements.
bool check_output(const JsonObject& channel, const AnimationSampler& sampler, AnimatedProperty property, int node,
                  const Document& document) {
  if (sampler.input < 0 || sampler.output < 0) return false;
  const Accessor& input = document.accessors[std::size_t(sampler.input)];
  const Accessor& output = document.accessors[std::size_t(sampler.output)];
  const std::string place = channel.place() / "sampler";
  const bool is_float = output.component == ComponentType::f32;
  const bool is_normalized = output.normalized && !is_float && output.component != ComponentType::u32;
  bool fits = false;
  const char* allowed = "VEC3 of FLOAT";
  std::uint64_t per_key = 1;
  switch (property) {
    case AnimatedProperty::translation:
    case AnimatedProperty::scale:
      fits = output.type == ElementType::vec3 && is_float;
      break;
    case AnimatedProperty::rotation:
      fits = output.type == ElementType::vec4 && (is_float || is_normalized);
      allowed = "VEC4 of FLOAT or normalized integers";
      break;
    case AnimatedProperty::weights:
      fits = output.type == ElementType::scalar && (is_float || is_normalized);
      allowed = "SCALAR of FLOAT or normalized integers";
      break;
  }
  if (!fits) {
    channel.diagnostics().fail(place, std::string("its output is an accessor of ") + name_of(output.type) + " of " +
                                          name_of(output.component) + ", allowed: " + allowed);
    return false;
  }
  if (property == AnimatedProperty::weights) {
    const int mesh = node >= 0 ? document.nodes[std::size_t(node)].mesh : -1;
    per_key = mesh >= 0 ? document.meshes[std::size_t(mesh)].target_count() : 0;
    if (per_key == 0) {
      channel.diagnostics().tolerate(channel.place() / "target", "animates weights of a node without morph targets",
                                     "it moves nothing");
      return false;
    }
  }
  if (sampler.interpolation == Interpolation::cubic_spline) {
    per_key *= 3;
    if (input.count < 2)
      channel.diagnostics().tolerate(place, "cubic splines need at least two keys", "its value is that of its key");
  }
  if (output.count != input.count * per_key)
    channel.diagnostics().fail(place, "has " + std::to_string(output.count) + " output elements for " +
                                          std::to_string(input.count) + " keys, expected " +
                                          std::to_string(input.count * per_key));
  return true;
}

}  // namespace

void read_animations(const JsonObject& root, Document& document) {
  root.each("animations", [&](const JsonObject& object, std::size_t) {
    object.only({"channels", "samplers"});
    document.extensions.check(object, Site::elsewhere);
    Animation animation;
    std::set<std::pair<int, AnimatedProperty>> driven;
    animation.name = object.string("name");
    object.require("channels");
    object.require("samplers");
    object.each("samplers", [&](const JsonObject& sampler, std::size_t) {
      animation.samplers.push_back(read_sampler(sampler, document));
    });
    object.each("channels", [&](const JsonObject& channel, std::size_t) {
      channel.only({"sampler", "target"});
      document.extensions.check(channel, Site::elsewhere);
      if (!channel.require({"sampler", "target"})) return;
      AnimationChannel result;
      result.sampler = channel.reference("sampler", animation.samplers.size(), "samplers");
      const JsonObject target = channel.object("target");
      target.only({"node", "path"});
      document.extensions.check(target, Site::channel_target);
      check_pointer(target);
      result.node = target.reference("node", document.nodes.size(), "nodes");
      if (!target.require("path")) return;
      const std::string path = target.string("path");
      if (path == "translation")
        result.property = AnimatedProperty::translation;
      else if (path == "rotation")
        result.property = AnimatedProperty::rotation;
      else if (path == "scale")
        result.property = AnimatedProperty::scale;
      else if (path == "weights")
        result.property = AnimatedProperty::weights;
      else {
        // The load report already says so of KHR_animation_pointer as a whole.
        if (!target.extension("KHR_animation_pointer").exists())
          channel.diagnostics().warn(target.place() / "path", "\"" + path + "\" is not animated");
        return;
      }
      if (result.sampler < 0) return;
      const AnimationSampler& sampler = animation.samplers[std::size_t(result.sampler)];
      if (!check_output(channel, sampler, result.property, result.node, document)) return;
      if (result.node < 0) return;  // glTF: a channel without a node is to be ignored
      if (document.nodes[std::size_t(result.node)].matrix && result.property != AnimatedProperty::weights) {
        channel.diagnostics().fail(target.place() / "node", "names a node with a matrix, which cannot be animated");
        return;
      }
      if (!driven.insert({result.node, result.property}).second) {
        channel.diagnostics().warn(target.place(), "is driven by an earlier channel of the same animation: left out");
        return;
      }
      animation.channels.push_back(result);
    });
    document.animations.push_back(std::move(animation));
  });
}

}  // namespace helio::gltf
