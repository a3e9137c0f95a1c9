#include "renderer/scene/gltf/animation.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <set>
#include <utility>

namespace helio::gltf {

namespace {

// The pair of keys around a time, and the position between them.
struct KeySpan {
  std::size_t first = 0, second = 0;
  double fraction = 0, seconds = 0;  // seconds: between the two keys
};

KeySpan find_keys(const std::vector<float>& times, double time) {
  const std::size_t last = times.size() - 1;
  if (!(time > times.front())) return {0, 0, 0, 0};
  if (time >= times.back()) return {last, last, 0, 0};
  const std::size_t after = std::size_t(
      std::upper_bound(times.begin(), times.end(), time, [](double t, float key) { return t < double(key); }) -
      times.begin());
  const double seconds = double(times[after]) - double(times[after - 1]);
  return {after - 1, after, (time - double(times[after - 1])) / seconds, seconds};
}

// Spherical interpolation along the shorter arc (appendix C.4), of unit quaternions.
std::array<double, 4> slerp(const float* a, const float* b, double t) {
  double cosine = 0;
  for (int c = 0; c < 4; ++c) cosine += double(a[c]) * double(b[c]);
  const double sign = cosine < 0 ? -1 : 1;
  cosine = std::min(std::abs(cosine), 1.0);
  const double angle = std::acos(cosine), sine = std::sin(angle);
  const bool close = sine < 1e-6;  // linear is exact to rounding there
  const double wa = close ? 1 - t : std::sin((1 - t) * angle) / sine;
  const double wb = sign * (close ? t : std::sin(t * angle) / sine);
  return {wa * a[0] + wb * b[0], wa * a[1] + wb * b[1], wa * a[2] + wb * b[2], wa * a[3] + wb * b[3]};
}

class AnimationPlayer {
 public:
  AnimationPlayer(const Document& document, int played, double time, AccessorReader& reader, Diagnostics& diagnostics)
      : document_(document),
        played_(played),
        time_(time),
        reader_(reader),
        diagnostics_(diagnostics),
        used_before_(reader.budget().used()) {}
  ~AnimationPlayer() { reader_.budget().release(reader_.budget().used() - used_before_); }

  void play(std::vector<Trs>& trs, std::vector<std::vector<float>>& weights) {
    for (std::size_t i = 0; i < document_.animations.size(); ++i) {
      const Animation& animation = document_.animations[i];
      for (const AnimationChannel& channel : animation.channels) {
        const AnimationSampler& sampler = animation.samplers[std::size_t(channel.sampler)];
        if (!check(sampler, channel.property)) return;
        if (int(i) != played_) continue;
        apply(sampler, channel, trs[std::size_t(channel.node)], weights[std::size_t(channel.node)]);
      }
    }
  }

 private:
  // An accessor with its integers normalised, read once however many channels name it. Null after a failure.
  const std::vector<float>* values(int accessor) {
    auto [found, added] = cache_.try_emplace(accessor);
    if (!added) return found->second.empty() ? nullptr : &found->second;
    std::vector<float>& out = found->second;
    if (reader_[accessor].type == ElementType::scalar) {
      reader_.read(accessor, out);
    } else if (reader_[accessor].type == ElementType::vec3) {
      std::vector<V3f> v;
      if (reader_.read(accessor, v) && reserve(v.size() * 3, accessor))
        for (const V3f& e : v) out.insert(out.end(), {e.x, e.y, e.z});
    } else {
      std::vector<V4f> v;
      if (reader_.read(accessor, v) && reserve(v.size() * 4, accessor))
        for (const V4f& e : v) out.insert(out.end(), {e.x, e.y, e.z, e.w});
    }
    return out.empty() ? nullptr : &out;
  }

  bool reserve(std::uint64_t floats, int accessor) {
    Status s = reader_.budget().reserve(floats, sizeof(float), "");
    if (!s.ok()) diagnostics_.fail(std::string() / "accessors" / std::size_t(accessor), s.error());
    return s.ok();
  }

  // Keys ascend, rotations are unit; each accessor is looked at once per use it has.
  bool check(const AnimationSampler& sampler, AnimatedProperty property) {
    const std::vector<float>* times = values(sampler.input);
    const std::vector<float>* output = values(sampler.output);
    if (!times || !output) return false;
    // Without data every key is at 0: nothing to evaluate, nothing to hold against the file.
    const bool has_keys = reader_[sampler.input].view >= 0 || reader_[sampler.input].sparse;
    if (has_keys && checked_.insert({sampler.input, -1}).second) {
      bool slipped = false;  // one is told
      for (std::size_t i = 0; i < times->size(); ++i) {
        if ((*times)[i] >= 0 && (i == 0 || (*times)[i] > (*times)[i - 1])) continue;
        const std::string place = std::string() / "accessors" / std::size_t(sampler.input);
        const std::string problem = "key " + std::to_string(i) + " is at " + std::to_string((*times)[i]) +
                                    " s, allowed: at least 0 and above the one before";
        if (i == 0 || (*times)[i] >= (*times)[i - 1]) {  // before the start, or two at once: the later one holds
          if (!std::exchange(slipped, true)) diagnostics_.tolerate(place, problem, "taken as it is");
          continue;
        }
        diagnostics_.fail(place, problem);
        return false;
      }
    }
    if (property != AnimatedProperty::rotation) return true;
    if (reader_[sampler.output].view < 0 && !reader_[sampler.output].sparse) return true;
    const bool cubic = sampler.interpolation == Interpolation::cubic_spline;
    if (!checked_.insert({sampler.output, cubic}).second) return true;
    for (std::size_t i = cubic ? 4 : 0; i + 4 <= output->size(); i += cubic ? 12 : 4) {
      double squared = 0;
      for (std::size_t c = 0; c < 4; ++c) squared += double((*output)[i + c]) * double((*output)[i + c]);
      if (!check_unit_rotation(std::string() / "accessors" / std::size_t(sampler.output), i / 4, std::sqrt(squared),
                               diagnostics_))
        return false;
    }
    return true;
  }

  void apply(const AnimationSampler& sampler, const AnimationChannel& channel, Trs& trs, std::vector<float>& weights) {
    const std::vector<float>& times = *values(sampler.input);
    const std::vector<float>& output = *values(sampler.output);
    const KeySpan keys = find_keys(times, time_);
    const std::size_t components =
        output.size() / times.size() / (sampler.interpolation == Interpolation::cubic_spline ? 3 : 1);
    switch (channel.property) {
      case AnimatedProperty::translation:
        for (std::size_t c = 0; c < 3; ++c) trs.translation[int(c)] = evaluate(sampler, keys, output, components, c);
        break;
      case AnimatedProperty::scale:
        for (std::size_t c = 0; c < 3; ++c) trs.scale[int(c)] = evaluate(sampler, keys, output, components, c);
        break;
      case AnimatedProperty::weights:
        weights.resize(components);
        for (std::size_t c = 0; c < components; ++c) weights[c] = float(evaluate(sampler, keys, output, components, c));
        break;
      case AnimatedProperty::rotation: {
        std::array<double, 4> q;
        if (sampler.interpolation == Interpolation::linear)
          q = slerp(&output[4 * keys.first], &output[4 * keys.second], keys.fraction);
        else
          for (std::size_t c = 0; c < 4; ++c) q[c] = evaluate(sampler, keys, output, components, c);
        const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        // A spline between opposite rotations may pass through zero: keep the key before it then.
        if (!(length > 1e-6)) return;
        for (std::size_t c = 0; c < 4; ++c) trs.rotation[c] = q[c] / length;
        break;
      }
    }
  }

  // One component of the output (appendix C.1, C.2, C.5).
  static double evaluate(const AnimationSampler& sampler, const KeySpan& keys, const std::vector<float>& output,
                         std::size_t components, std::size_t c) {
    const double t = keys.fraction;
    switch (sampler.interpolation) {
      case Interpolation::step:
        return output[keys.first * components + c];
      case Interpolation::linear:
        return (1 - t) * double(output[keys.first * components + c]) + t * double(output[keys.second * components + c]);
      case Interpolation::cubic_spline:
        break;
    }
    // Stored per key: in-tangent, value, out-tangent.
    const auto at = [&](std::size_t key, std::size_t part) {
      return double(output[(3 * key + part) * components + c]);
    };
    const double t2 = t * t, t3 = t2 * t;
    return (2 * t3 - 3 * t2 + 1) * at(keys.first, 1) + keys.seconds * (t3 - 2 * t2 + t) * at(keys.first, 2) +
           (-2 * t3 + 3 * t2) * at(keys.second, 1) + keys.seconds * (t3 - t2) * at(keys.second, 0);
  }

  const Document& document_;
  int played_;
  double time_;
  AccessorReader& reader_;
  Diagnostics& diagnostics_;
  std::uint64_t used_before_;
  std::map<int, std::vector<float>> cache_;
  std::set<std::pair<int, int>> checked_;  // input with -1, rotation output with 0 or 1 (cubic)
};

}  // namespace

bool check_unit_rotation(const std::string& place, std::size_t index, double length, Diagnostics& diagnostics) {
  constexpr double kRounding = 0.02, kTolerance = 0.05;  // integers of eight bits round by 0.008
  const double off = std::abs(length - 1);
  if (off <= kRounding) return true;
  const std::string problem =
      "rotation " + std::to_string(index) + " has length " + std::to_string(length) + ", expected 1";
  if (off <= kTolerance) {
    diagnostics.tolerate(place, problem, "made so");
    return true;
  }
  diagnostics.fail(place, problem);
  return false;
}

std::string animation_name(const Document& document, std::size_t index) {
  const std::string& name = document.animations[index].name;
  return name.empty() ? "animation " + std::to_string(index) : name;
}

int choose_animation(const Document& document, const std::string& wanted, Diagnostics& diagnostics) {
  const std::size_t count = document.animations.size();
  if (wanted.empty()) {
    for (std::size_t i = 0; i < count; ++i)
      if (!document.animations[i].channels.empty()) return int(i);
    return -1;
  }
  for (std::size_t i = 0; i < count; ++i)
    if (animation_name(document, i) == wanted) return int(i);
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), number);
  if (error == std::errc() && end == wanted.data() + wanted.size() && number < count) return int(number);
  constexpr std::size_t kShown = 60;
  const std::string quoted = '"' + wanted.substr(0, kShown) + '"';
  if (count == 0)
    diagnostics.fail("/animations", "there is no animation " + quoted + ": the file has none");
  else
    diagnostics.fail("/animations", "there is no animation " + quoted + ", allowed: " + list_animations(document, -1) +
                                        ", or a number from 0 to " + std::to_string(count - 1));
  return -1;
}

std::string list_animations(const Document& document, int without) {
  constexpr std::size_t kShown = 16;
  std::string names;
  std::size_t listed = 0;
  for (std::size_t i = 0; i < document.animations.size(); ++i) {
    if (int(i) == without) continue;
    if (++listed <= kShown) names += (listed == 1 ? "\"" : ", \"") + animation_name(document, i) + '"';
  }
  return listed <= kShown ? names : names + " and " + std::to_string(listed - kShown) + " more";
}

void apply_animation(const Document& document, int played, double time_s, AccessorReader& reader,
                     Diagnostics& diagnostics, std::vector<Trs>& trs, std::vector<std::vector<float>>& weights) {
  AnimationPlayer(document, played, time_s, reader, diagnostics).play(trs, weights);
}

}  // namespace helio::gltf
