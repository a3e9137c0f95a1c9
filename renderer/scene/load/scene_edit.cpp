#include "renderer/scene/load/scene_edit.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace helio {
namespace {

constexpr std::size_t kMaxCandidates = 5;
// Longer names are compared by their first characters.
constexpr std::size_t kComparedCharacters = 64;
// Of a scene's names only so many are compared.
constexpr std::size_t kComparedNames = 100000;

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c;
}

// Levenshtein's distance without regard to case.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  a = a.substr(0, kComparedCharacters);
  b = b.substr(0, kComparedCharacters);
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (lower(a[i - 1]) != lower(b[j - 1]));
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

std::string shown(const Rgb& c) {
  return fmt::format("({}, {}, {})", c.x, c.y, c.z);
}

// What can be edited, as names for messages.
template <class Item>
struct Kind {
  const std::vector<Item>& items;
  const char* what;    // "material"
  const char* plural;  // "materials"
};

template <class Item>
std::string candidates(const Kind<Item>& kind, const std::string& name) {
  std::vector<std::pair<std::size_t, std::string>> near;
  for (std::size_t i = 0; i < std::min(kind.items.size(), kComparedNames); ++i) {
    const std::string& other = kind.items[i].name;
    if (!other.empty()) near.emplace_back(edit_distance(name, other), other);
  }
  std::sort(near.begin(), near.end());
  near.erase(std::unique(near.begin(), near.end()), near.end());
  if (near.empty()) return fmt::format("none of the scene's {} {} has a name", kind.items.size(), kind.plural);
  std::string text;
  for (std::size_t i = 0; i < std::min(near.size(), kMaxCandidates); ++i) {
    text += (text.empty() ? "'" : ", '") + near[i].second + "'";
  }
  if (near.size() > kMaxCandidates) text += fmt::format(" and {} others", near.size() - kMaxCandidates);
  if (kind.items.size() > kComparedNames) {
    text += fmt::format("; of {} {}, the first {} were compared: any name or number may be given", kind.items.size(),
                        kind.plural, kComparedNames);
  }
  return text;
}

template <class Item>
std::optional<std::uint32_t> find(const Kind<Item>& kind, const EditTarget& target, const std::string& where,
                                  Problems& problems) {
  if (const auto* index = std::get_if<std::uint32_t>(&target)) {
    if (*index < kind.items.size()) return *index;
    problems.add(where + ".index", kind.items.empty()
                                       ? fmt::format("{}; the scene has no {}", *index, kind.plural)
                                       : fmt::format("{}; allowed: [0, {}]", *index, kind.items.size() - 1));
    return std::nullopt;
  }
  const std::string& name = std::get<std::string>(target);
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < kind.items.size(); ++i) {
    if (kind.items[i].name == name) found.push_back(i);
  }
  if (found.size() == 1) return std::uint32_t(found.front());
  if (found.empty()) {
    problems.add(where + ".name", kind.items.empty() ? fmt::format("'{}'; the scene has no {}", name, kind.plural)
                                                     : fmt::format("there is no {} '{}'; allowed: {}", kind.what, name,
                                                                   candidates(kind, name)));
    return std::nullopt;
  }
  std::string numbers;
  for (std::size_t i = 0; i < std::min(found.size(), kMaxCandidates); ++i) {
    numbers += (numbers.empty() ? "" : ", ") + std::to_string(found[i]);
  }
  problems.add(where + ".name", fmt::format("{} {} are called '{}'; give the number of one instead: {}{}", found.size(),
                                            kind.plural, name, numbers, found.size() > kMaxCandidates ? ", ..." : ""));
  return std::nullopt;
}

bool in_range(const Rgb& c, float high) {
  return c.x >= 0 && c.y >= 0 && c.z >= 0 && c.x <= high && c.y <= high && c.z <= high;
}

constexpr float kMaxFloat = std::numeric_limits<float>::max();

class Resolver {
 public:
  explicit Resolver(const SceneDescription& scene) : scene_(scene) {}

  Result<SceneChanges> run(std::span<const SceneEdit> edits) {
    if (edits.empty() || edits.size() > kMaxSceneEdits) {
      problems_.add("edits", fmt::format("{} edits; allowed: [1, {}]", edits.size(), kMaxSceneEdits));
      return problems_.to_error();
    }
    for (std::size_t i = 0; i < edits.size(); ++i) {
      const std::string where = fmt::format("edits[{}]", i);
      std::visit([&](const auto& edit) { apply(edit, where); }, edits[i]);
    }
    if (!problems_.empty()) return problems_.to_error();
    std::erase_if(changes_.materials, [](const auto& entry) { return entry.second.from == entry.second.to; });
    std::erase_if(changes_.lights, [](const auto& entry) { return entry.second.from == entry.second.to; });
    if (changes_.environment && changes_.environment->from == changes_.environment->to) changes_.environment.reset();
    return std::move(changes_);
  }

 private:
  void apply(const ObjectEdit& edit, const std::string& edit_where) {
    const std::string where = edit_where + ".object";
    const auto index = find(Kind<Instance>{scene_.instances, "object", "objects"}, edit.target, where, problems_);
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 3; ++j) {
        if (std::isfinite(edit.transform[i][j])) continue;
        problems_.add(where + ".transform",
                      fmt::format("{} in row {}, column {}; allowed: finite", edit.transform[i][j], j, i));
        return;
      }
    }
    if (!index) return;
    const M44d& now = scene_.instances[*index].to_world;
    const auto entry = changes_.transforms.try_emplace(*index, Changed<M44d>{now, now}).first;
    M44d transform = edit.transform;
    for (int i = 0; i < 4; ++i) transform[i][3] = i == 3 ? 1 : 0;
    entry->second.to = edit.relative ? entry->second.to * transform : transform;
  }

  void apply(const MaterialEdit& edit, const std::string& edit_where) {
    const std::string where = edit_where + ".material";
    const auto index = find(Kind<Material>{scene_.materials, "material", "materials"}, edit.target, where, problems_);
    if (!edit.base_color && !edit.emission && !edit.roughness) {
      problems_.add(where, "changes nothing; give one of base_color, emission, roughness");
    }
    if (edit.base_color && !in_range(*edit.base_color, 1)) {
      problems_.add(where + ".base_color", shown(*edit.base_color) + "; allowed: [0, 1] each");
    }
    if (edit.emission && !in_range(*edit.emission, kMaxFloat)) {
      problems_.add(where + ".emission", shown(*edit.emission) + "; allowed: finite and at least 0 each");
    }
    if (edit.roughness && !(*edit.roughness >= 0 && *edit.roughness <= 1)) {
      problems_.add(where + ".roughness", fmt::format("{}; allowed: [0, 1]", *edit.roughness));
    }
    if (!index) return;
    const MaterialModel model = scene_.materials[*index].model;
    const EditableValues has = editable_values(model);
    if (edit.base_color && !has.base_color) refuse(where + ".base_color", model);
    if (edit.emission && !has.emission) refuse(where + ".emission", model);
    if (edit.roughness && !has.roughness) refuse(where + ".roughness", model);
    const MaterialValues now = material_values(scene_.materials[*index]);
    MaterialValues& to = changes_.materials.try_emplace(*index, Changed<MaterialValues>{now, now}).first->second.to;
    if (edit.base_color) to.base_color = *edit.base_color;
    if (edit.emission) to.emission = *edit.emission;
    if (edit.roughness) to.roughness = *edit.roughness;
  }

  void refuse(const std::string& where, MaterialModel model) {
    problems_.add(where, fmt::format("a material of model {} has none; allowed: absent", to_string(model)));
  }

  void apply(const LightEdit& edit, const std::string& edit_where) {
    const std::string where = edit_where + ".light";
    const auto index = find(Kind<PunctualLight>{scene_.lights, "light", "point, spot or directional lights"},
                            edit.target, where, problems_);
    if (!index) return scale({}, edit.intensity, edit.scale, where, "intensity");
    const Rgb now = scene_.lights[*index].intensity;
    Rgb& to = changes_.lights.try_emplace(*index, Changed<Rgb>{now, now}).first->second.to;
    scale(&to, edit.intensity, edit.scale, where, "intensity");
  }

  void apply(const EnvironmentEdit& edit, const std::string& edit_where) {
    const std::string where = edit_where + ".environment";
    if (!scene_.environment) {
      problems_.add(where, "the scene has none; load it with one");
      return scale({}, edit.radiance, edit.scale, where, "radiance");
    }
    const Rgb now = scene_.environment->radiance;
    if (!changes_.environment) changes_.environment = Changed<Rgb>{now, now};
    scale(&changes_.environment->to, edit.radiance, edit.scale, where, "radiance");
  }

  // value := (given or value) * factor. Null: only what is given is looked at.
  void scale(Rgb* value, const std::optional<Rgb>& given, double factor, const std::string& where, const char* name) {
    if (!given && factor == 1) {
      problems_.add(where, fmt::format("changes nothing; give one of {}, scale", name));
      return;
    }
    const bool given_fits = !given || in_range(*given, kMaxFloat), factor_fits = factor >= 0 && std::isfinite(factor);
    if (!given_fits) {
      problems_.add(where + "." + name, shown(*given) + "; allowed: finite and at least 0 each");
    }
    if (!factor_fits) problems_.add(where + ".scale", fmt::format("{}; allowed: finite and at least 0", factor));
    if (!value || !given_fits || !factor_fits) return;
    if (given) *value = *given;
    if (factor == 1) return;
    const V3d product = V3d(*value) * factor;
    if (!(max_component(*value) * factor <= double(kMaxFloat))) {
      problems_.add(where + ".scale", fmt::format("{} makes {} of ({}, {}, {}) too large; allowed: finite results",
                                                  factor, name, value->x, value->y, value->z));
      return;
    }
    *value = Rgb(product);
  }

  const SceneDescription& scene_;
  Problems problems_;
  SceneChanges changes_;
};

template <class T>
void merge(std::map<std::uint32_t, Changed<T>>& into, const std::map<std::uint32_t, Changed<T>>& second,
           bool keep_unchanged) {
  for (const auto& [index, change] : second) {
    const auto entry = into.try_emplace(index, change).first;
    entry->second.to = change.to;
    if (!keep_unchanged && entry->second.from == entry->second.to) into.erase(entry);
  }
}

}  // namespace

EditableValues editable_values(MaterialModel model) {
  const bool blend = model == MaterialModel::blend, unlit = model == MaterialModel::unlit;
  return {model != MaterialModel::conductor && !blend, !unlit, model != MaterialModel::pane && !unlit && !blend};
}

const char* to_string(MaterialModel model) {
  switch (model) {
    case MaterialModel::metallic_roughness:
      return "metallic_roughness";
    case MaterialModel::specular_glossiness:
      return "specular_glossiness";
    case MaterialModel::unlit:
      return "unlit";
    case MaterialModel::conductor:
      return "conductor";
    case MaterialModel::plastic:
      return "plastic";
    case MaterialModel::pane:
      return "pane";
    case MaterialModel::principled:
      return "principled";
    case MaterialModel::blend:
      return "blend";
  }
  return "";
}

MaterialValues material_values(const Material& material) {
  const bool glossy = material.model == MaterialModel::specular_glossiness;
  return {material.base_color, material.emission, glossy ? 1 - material.glossiness : material.roughness};
}

void set_material_values(const MaterialValues& values, Material& material) {
  // What did not change keeps its bits: 1 - (1 - glossiness) may differ from it.
  const MaterialValues now = material_values(material);
  material.base_color = values.base_color;
  material.emission = values.emission;
  if (values.roughness == now.roughness) return;
  (material.model == MaterialModel::specular_glossiness ? material.glossiness : material.roughness) =
      material.model == MaterialModel::specular_glossiness ? 1 - values.roughness : values.roughness;
}

Result<SceneChanges> resolve_edits(const SceneDescription& scene, std::span<const SceneEdit> edits) {
  return Resolver(scene).run(edits);
}

SceneChanges merge_changes(const SceneChanges& first, const SceneChanges& second) {
  SceneChanges merged = first;
  merge(merged.transforms, second.transforms, true);
  merge(merged.materials, second.materials, false);
  merge(merged.lights, second.lights, false);
  if (second.environment) {
    const Rgb from = first.environment ? first.environment->from : second.environment->from;
    merged.environment = Changed<Rgb>{from, second.environment->to};
    if (from == second.environment->to) merged.environment.reset();
  }
  return merged;
}

}  // namespace helio
