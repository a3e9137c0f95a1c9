#include "tests/unit/client/report/made_up_record.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

#include "renderer/codec/tile_codec.h"

namespace helio::report {
namespace {

namespace pb = heliograph::v1;
namespace fs = std::filesystem;

constexpr double kIntervalShare = 0.1;

double error_of(std::size_t mode, std::uint32_t budget) {
  return double(1 + mode) / std::exp2(budget);
}
double seconds_of(std::size_t mode, std::uint32_t budget) {
  return 0.1 * std::exp2(budget) / double(1 + mode);
}

void set_interval(pb::CompareInterval& interval, double mean, std::uint32_t seeds) {
  interval.set_mean(mean);
  interval.set_known(seeds >= 5);
  if (seeds < 5) return;
  interval.set_low(mean * (1 - kIntervalShare));
  interval.set_high(mean * (1 + kIntervalShare));
}

// In the order of the protocol, those that pictures along a path alone have at the end.
std::vector<pb::CompareMeasure> measures_of(const RecordShape& shape) {
  std::vector<pb::CompareMeasure> all;
  for (int i = 1; i <= shape.measures; ++i) all.push_back(pb::CompareMeasure(i));
  if (shape.previews) all.push_back(pb::COMPARE_MEASURE_FLICKER);
  return all;
}

double scale_of(pb::CompareMeasure measure) {
  return measure == pb::COMPARE_MEASURE_RELMSE ? 1.0
         : measure == pb::COMPARE_MEASURE_BIAS ? -0.01
                                               : 0.1 * double(measure);
}

void add_points(pb::CompareRecord& record, const RecordShape& shape, std::size_t mode, std::uint32_t view,
                bool all_views) {
  for (std::uint32_t budget = 0; budget < shape.budgets; ++budget) {
    pb::ComparePoint& point = *record.mutable_table()->add_points();
    point.set_mode(shape.modes[mode]);
    point.set_budget(budget);
    point.set_view(view);
    point.set_all_views(all_views);
    point.set_seeds(shape.seeds);
    set_interval(*point.mutable_seconds(), seconds_of(mode, budget), shape.seeds);
    point.set_samples(std::exp2(budget));
    const auto measures = measures_of(shape);
    for (std::size_t i = 0; i < measures.size(); ++i) {
      for (const char* region : {"", "dark half"}) {
        if (*region != '\0' && i >= 3) continue;
        pb::ComparePoint::Value& value = *point.add_values();
        value.set_measure(measures[i]);
        value.set_region(region);
        set_interval(*value.mutable_value(), scale_of(measures[i]) * error_of(mode, budget), shape.seeds);
        value.set_few_pixels_decide(mode == 2 && budget == 0);
      }
    }
  }
}

void add_ratio(pb::CompareRecord& record, const RecordShape& shape, std::size_t mode, pb::CompareRatio::Kind kind,
               pb::CompareMeasure measure, const char* region, double at) {
  pb::CompareRatio& ratio = *record.mutable_table()->add_ratios();
  ratio.set_kind(kind);
  ratio.set_mode(shape.modes[mode]);
  ratio.set_baseline(shape.modes[0]);
  ratio.set_measure(measure);
  ratio.set_region(region);
  ratio.set_at(at);
  const double good = mode == 1 ? 2.0 : mode == 2 ? 0.625 : 1.02;
  set_interval(*ratio.mutable_ratio(), kind == pb::CompareRatio::KIND_EQUAL_ERROR ? good : 1 / good, shape.seeds);
  ratio.set_verdict(shape.seeds < 5 || mode > 2 ? pb::COMPARE_VERDICT_UNDECIDED
                    : mode == 1                 ? pb::COMPARE_VERDICT_BETTER
                                                : pb::COMPARE_VERDICT_WORSE);
}

void add_ratios(pb::CompareRecord& record, const RecordShape& shape, std::size_t mode) {
  for (std::uint32_t budget = 0; budget < shape.budgets; ++budget) {
    add_ratio(record, shape, mode, pb::CompareRatio::KIND_SPEED, pb::COMPARE_MEASURE_UNSPECIFIED, "",
              std::exp2(budget));
    const auto measures = measures_of(shape);
    for (std::size_t i = 0; i < measures.size(); ++i) {
      if (measures[i] == pb::COMPARE_MEASURE_BIAS || measures[i] > pb::COMPARE_MEASURE_FLICKER) continue;  // no errors
      for (const char* region : {"", "dark half"}) {
        if (*region != '\0' && i >= 3) continue;
        add_ratio(record, shape, mode, pb::CompareRatio::KIND_EQUAL_ERROR, measures[i], region, error_of(0, budget));
        add_ratio(record, shape, mode, pb::CompareRatio::KIND_EQUAL_TIME, measures[i], region, seconds_of(0, budget));
        add_ratio(record, shape, mode, pb::CompareRatio::KIND_EQUAL_SAMPLES, measures[i], region, std::exp2(budget));
      }
    }
  }
}

void add_units(pb::CompareRecord& record, const RecordShape& shape, std::size_t mode) {
  for (std::uint32_t seed = 1; seed <= shape.seeds; ++seed) {
    for (std::uint32_t budget = 0; budget < shape.budgets; ++budget) {
      for (std::uint32_t view = 0; view < shape.views; ++view) {
        pb::CompareUnit& unit = *record.add_units();
        unit.set_mode(shape.modes[mode]);
        unit.set_seed_number(seed);
        unit.set_budget(budget);
        unit.set_view(view);
        unit.set_seed(1000 + seed);
        unit.set_seconds(seconds_of(mode, budget) * (1 + 0.01 * seed));
        unit.set_samples(std::exp2(budget));
        pb::CompareValue& value = *unit.add_values();
        value.set_measure(pb::COMPARE_MEASURE_RELMSE);
        value.set_value(error_of(mode, budget));
        if (shape.previews && mode + 1 == shape.modes.size()) unit.set_seconds(0.020 + 0.001 * view + 0.0003 * seed);
        if (budget + 1 < shape.budgets) continue;
        for (int i = 0; i < 2; ++i) {
          pb::ComparePixel& pixel = *unit.add_worst();
          pixel.set_x(7 + i);
          pixel.set_y(int(view));
          pixel.mutable_picture()->set_x(12.5);
          pixel.mutable_reference()->set_y(0.25);
          pixel.set_share(0.125);
          if (i == 0) pixel.set_replay_token("hr1.token-of-" + shape.modes[mode]);
        }
      }
    }
  }
}

void write_picture(pb::CompareRecord& record, const fs::path& folder, const std::string& name, int width, int height,
                   double noise, const pb::CompareRecord::Picture& described) {
  std::mt19937 random(1);
  std::gamma_distribution<float> spread(noise > 0 ? float(1 / noise) : 1.0f, noise > 0 ? float(noise) : 1.0f);
  std::vector<float> planes[3];
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double u = double(x) / width, v = double(y) / height;
      const double disc = std::hypot(u - 0.7, (v - 0.3) * height / width) < 0.12 ? 20.0 : 0.0;
      for (int c = 0; c < 3; ++c) {
        const double clean =
            0.02 + u * (c == 0 ? 1.0 : 0.6) * v + (c == 2 ? 0.3 * (1 - v) : 0.05) + disc * (c == 2 ? 0.6 : 1.0);
        planes[c].push_back(float(clean) * (noise > 0 ? spread(random) : 1.0f));
      }
    }
  }
  const std::vector<TileChannel> channels{{"R", planes[0].data()}, {"G", planes[1].data()}, {"B", planes[2].data()}};
  const std::string file = "pictures/" + name + ".exr";
  const Status written = write_exr((folder / file).string(), {{0, 0, width, height}, width, height}, channels,
                                   {TilePixelType::float32, TileCompression::zip});
  if (!written) throw std::runtime_error(written.error().to_string());
  pb::CompareRecord::Picture& picture = *record.add_pictures();
  picture = described;
  picture.set_file(file);
}

}  // namespace

pb::CompareRecord made_up_record(const RecordShape& shape) {
  pb::CompareRecord record;
  record.set_format(1);
  record.set_scene_name("Cornell box");
  record.set_scene_file("scenes/cornell-box/cornell-box.gltf");
  pb::CompareRequest& request = *record.mutable_request();
  request.set_scene_id("scene-4f2a");
  request.set_seeds(shape.seeds);
  request.set_first_seed(1000);
  request.set_worst_pixels(2);
  request.mutable_reference()->mutable_rendered()->set_error(0.01);
  request.mutable_reference()->mutable_rendered()->set_max_samples(65536);
  for (std::uint32_t b = 0; b < shape.budgets; ++b) request.add_samples(1u << b);
  for (std::uint32_t v = 0; v < shape.views; ++v) {
    request.add_views()->set_scene_camera(std::to_string(v));
    auto& reference = *record.add_references();
    reference.set_view(v);
    reference.set_noise(pb::CompareResponse::Reference::NOISE_HALVES);
    reference.set_error(0.0098);
    reference.set_samples(8192);
    reference.set_seconds(41.5);
    reference.set_reference_id("reference-" + std::to_string(v));
  }
  auto& call = *record.add_calls();
  call.set_command_line("heliograph compare scenes/cornell-box/cornell-box.gltf --modes pt,adaptive,bdpt --seeds 5");
  call.set_begun("2026-01-31T12:00:00Z");
  call.set_version("0.1.0");
  call.set_build("Release, GCC 12.2");
  call.set_isa("avx2");
  call.set_threads(8);
  call.set_units(shape.seeds * shape.budgets * shape.views * std::uint32_t(shape.modes.size()));
  call.set_seconds(312.5);
  call.set_ended(true);
  record.mutable_table()->add_sentences(
      "adaptive reaches the relative MSE of pt in half of the time (2.0, 1.8 to 2.2).");
  record.mutable_table()->add_sentences("bdpt takes longer than pt to the same error.");
  for (std::size_t mode = 0; mode < shape.modes.size(); ++mode) {
    pb::CompareMode& compared = *request.add_modes();
    compared.set_name(shape.modes[mode]);
    pb::RenderSettings& settings = *compared.mutable_settings();
    settings.set_width(shape.width);
    settings.set_height(shape.height);
    settings.set_mode(mode == 1 ? pb::MODE_ADAPTIVE : pb::MODE_PT);
    settings.set_integrator(mode == 2 ? pb::INTEGRATOR_BDPT : pb::INTEGRATOR_PATH);
    settings.set_max_segments(10);
    settings.set_roulette_from(3);
    compared.set_picture(pb::COMPARED_PICTURE_FILM);
    if (shape.previews && mode + 1 == shape.modes.size()) {
      compared.set_picture(pb::COMPARED_PICTURE_PREVIEW);
      settings.set_preview_rate(30);
      settings.set_preview_budget_ms(24);
    }
    for (std::uint32_t v = 0; v < shape.views; ++v) add_points(record, shape, mode, v, false);
    if (shape.views > 1) add_points(record, shape, mode, 0, true);
    if (mode > 0) add_ratios(record, shape, mode);
    add_units(record, shape, mode);
  }
  return record;
}

void write_pictures(pb::CompareRecord& record, const RecordShape& shape, const fs::path& folder) {
  fs::create_directories(folder / "pictures");
  for (std::uint32_t view = 0; view < shape.views; ++view) {
    const std::string suffix = ".view" + std::to_string(view);
    pb::CompareRecord::Picture described;
    described.set_view(view);
    described.set_reference(true);
    write_picture(record, folder, "reference" + suffix, shape.width, shape.height, 0, described);
    described.set_reference(false);
    described.set_seed_number(1);
    described.set_budget(shape.budgets - 1);
    for (std::size_t mode = 0; mode < shape.modes.size(); ++mode) {
      described.set_mode(shape.modes[mode]);
      write_picture(record, folder, shape.modes[mode] + suffix, shape.width, shape.height, 0.05 * double(1 + mode),
                    described);
    }
  }
}

}  // namespace helio::report
