#include "client/cli/commands/replay_report.h"

#include <spdlog/fmt/fmt.h>

#include "client/cli/terminal.h"

namespace helio::cli {

namespace pb = heliograph::v1;

namespace {

// Digits enough to tell any two floats, or positions of any size, apart.
template <class Vector>
std::string show(const Vector& v) {
  return fmt::format("({:.9g}, {:.9g}, {:.9g})", v.x(), v.y(), v.z());
}

std::string describe_light(const pb::TracedLight& light) {
  std::string text =
      fmt::format("  light      {}{}, distance {:.9g}, radiance {}, pdf {:.9g}\n", show(light.direction()),
                  light.delta() ? " without extent" : "", light.distance(), show(light.radiance()), light.pdf());
  if (!light.evaluated()) return text + "             sends nothing here\n";
  text += fmt::format("             f cos {}, pdf of the surface {:.9g}, weight {:.9g}\n", show(light.f_cos()),
                      light.bsdf_pdf(), light.mis_weight());
  if (!light.shadow_ray()) return text + "             the surface sends nothing on: no shadow ray\n";
  return text + fmt::format("             shadow ray {}, contribution {}\n", light.occluded() ? "blocked" : "arrives",
                            show(light.contribution()));
}

std::string describe_surface(const pb::TracedVertex& v) {
  std::string text = fmt::format("  hit        '{}' primitive {} at {:.9g}, {} side\n", single_line(v.instance()),
                                 v.primitive(), v.distance(), v.front() ? "front" : "back");
  text += fmt::format("  position   {}\n", show(v.position()));
  text += fmt::format("  normals    geometric {}, shading {}\n", show(v.geometric_normal()), show(v.shading_normal()));
  return text + fmt::format(
                    "  material   '{}' {}: base color {}, alpha {:.9g}, metallic {:.9g}, transmission {:.9g}, "
                    "ior {:.9g}\n",
                    single_line(v.material()), v.lobe_model(), show(v.base_color()), v.alpha(), v.metallic(),
                    v.transmission(), v.ior());
}

std::string describe_scatter(const pb::TracedVertex& v) {
  if (!(v.next_pdf() != 0)) return "  scatters   in no direction\n";
  std::string text = fmt::format("  scatters   {}{}{}, pdf {:.9g}, weight {}\n", show(v.next_direction()),
                                 v.next_delta() ? ", delta" : "", v.next_transmitted() ? ", transmitted" : "",
                                 v.next_pdf(), show(v.weight()));
  text += fmt::format("             throughput {}\n", show(v.next_throughput()));
  if (v.roulette()) {
    text += fmt::format("  roulette   survives below {:.9g}, drew {:.9g}\n", v.survival(), v.roulette_sample());
  }
  return text;
}

}  // namespace

std::string describe_id(const pb::SampleId& id) {
  const std::string sample = fmt::format("half {}, sample {}", id.half(), id.index());
  if (id.light_path() > 0) return fmt::format("light path {} of {}", id.light_path(), sample);
  return fmt::format("pixel {},{}, {}", id.x(), id.y(), sample);
}

std::string describe_sample(const pb::ReplaySampleResponse& replay) {
  const pb::SampleReplay& s = replay.sample();
  std::string text = fmt::format("{} of a {}x{} film, seed {}, of '{}'\n", describe_id(s.sample()), s.width(),
                                 s.height(), s.seed(), single_line(s.main_file()));
  text += fmt::format("radiance {}: {}", show(replay.radiance()), replay.finite() ? "finite" : "invalid");
  if (!replay.first_not_finite().empty()) {
    text +=
        fmt::format(", first not finite at {}vertex {}: {}", replay.first_not_finite_on_light_path() ? "light " : "",
                    replay.first_not_finite_vertex(), replay.first_not_finite());
  }
  return text;
}

std::string describe_light_vertex(const pb::TracedLightVertex& v, const std::string& first_not_finite) {
  std::string text = fmt::format("light vertex {}, {} segments from the light\n", v.number(), v.segments());
  text += fmt::format("  hit        '{}' primitive {} at {:.9g} along {}\n", single_line(v.instance()), v.primitive(),
                      v.distance(), show(v.arrived()));
  text += fmt::format("  position   {}\n", show(v.position()));
  text += fmt::format("  normal     {}, material '{}'\n", show(v.geometric_normal()), single_line(v.material()));
  if (v.has_splat()) {
    const pb::TracedSplat& splat = v.splat();
    text += fmt::format("  camera     sees it at {:.9g},{:.9g}, weight {:.9g}, {}, contribution {}\n", splat.film_x(),
                        splat.film_y(), splat.mis_weight(), splat.occluded() ? "blocked" : "arrives",
                        show(splat.contribution()));
  }
  if (!first_not_finite.empty()) text += fmt::format("  >>> first not finite: {}\n", first_not_finite);
  return text + fmt::format("  throughput {}", show(v.throughput()));
}

std::string describe_vertex(const pb::TracedVertex& v, const std::string& first_not_finite) {
  std::string text = fmt::format("vertex {}\n", v.number());
  text += fmt::format("  ray        from {} along {}, pdf {:.9g}\n", show(v.origin()), show(v.direction()), v.pdf());
  text += fmt::format("  so far     radiance {}, throughput {}\n", show(v.radiance_before()), show(v.throughput()));
  if (v.hit()) text += describe_surface(v);
  if (v.has_emitted()) {
    text += fmt::format("  emission   {} {}, weight {:.9g}\n", v.hit() ? "of the surface" : "of the environment",
                        show(v.emitted()), v.emitted_weight());
  }
  if (v.has_light()) text += describe_light(v.light());
  for (const pb::TracedConnection& connection : v.connections()) {
    text += fmt::format("  joined     to light vertex {} at {:.9g}, weight {:.9g}, {}, contribution {}\n",
                        connection.light_vertex(), connection.distance(), connection.mis_weight(),
                        connection.occluded() ? "blocked" : "arrives", show(connection.contribution()));
  }
  if (v.merged() > 0)
    text += fmt::format("  merged     with {} light vertices, contribution {}\n", v.merged(),
                        show(v.merged_contribution()));
  if (v.sampled()) text += describe_scatter(v);
  if (!first_not_finite.empty()) text += fmt::format("  >>> first not finite: {}\n", first_not_finite);
  return text + "  the path   " + v.outcome();
}

}  // namespace helio::cli
