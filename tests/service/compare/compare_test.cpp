// Compare and LoadReference.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <thread>

#include "renderer/base/clock.h"
#include "renderer/codec/tile_codec.h"
#include "server/base/processor_time.h"
#include "server/compare/compare_core.h"
#include "service_fixture.h"

namespace helio::test {
namespace {

using grpc::StatusCode;

class CompareTest : public ServiceTest {
 protected:
  struct Outcome {
    std::vector<pb::CompareResponse> messages;
    grpc::Status status;

    std::vector<pb::CompareUnit> units() const {
      std::vector<pb::CompareUnit> units;
      for (const auto& message : messages) {
        if (message.has_unit()) units.push_back(message.unit());
      }
      return units;
    }
    std::vector<pb::CompareResponse::Reference> references() const {
      std::vector<pb::CompareResponse::Reference> references;
      for (const auto& message : messages) {
        if (message.has_reference()) references.push_back(message.reference());
      }
      return references;
    }
    const pb::CompareResponse::Result& result() const { return messages.back().result(); }
  };

  Outcome run(const pb::CompareRequest& request) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60 * kPatience));
    auto reader = stub().Compare(&context, request);
    Outcome outcome;
    pb::CompareResponse response;
    while (reader->Read(&response)) outcome.messages.push_back(response);
    outcome.status = reader->Finish();
    return outcome;
  }

  void start_with_scene(const std::function<void(ServerConfig&)>& change = {}) {
    start(change);
    scene_ = load_quad();
  }

  // Two modes that differ in their names alone, small pictures, a reference of few samples.
  pb::CompareRequest request(int side = 24) const {
    pb::CompareRequest request;
    request.set_scene_id(scene_);
    for (const char* name : {"first", "second"}) {
      pb::CompareMode& mode = *request.add_modes();
      mode.set_name(name);
      mode.mutable_settings()->set_width(side);
      mode.mutable_settings()->set_height(side);
    }
    request.set_seeds(2);
    request.add_samples(1);
    request.add_samples(4);
    request.mutable_reference()->mutable_rendered()->set_error(1);
    return request;
  }
  static pb::CameraView camera(double x) {
    pb::CameraView view;
    view.mutable_position()->set_x(x);
    view.mutable_position()->set_z(3);
    view.mutable_look_at()->mutable_target()->set_x(x);
    return view;
  }

  grpc::Status load_reference(const std::string& exr, pb::LoadReferenceResponse* response, std::string sha256 = {}) {
    grpc::ClientContext context;
    auto writer = stub().LoadReference(&context, response);
    pb::LoadReferenceRequest begin;
    begin.mutable_begin()->set_bytes(exr.size());
    begin.mutable_begin()->set_sha256(sha256.empty() ? sha256_of(exr) : sha256);
    writer->Write(begin);
    for (std::size_t at = 0; at < exr.size(); at += 1 << 20) {
      pb::LoadReferenceRequest data;
      data.set_data(exr.substr(at, 1 << 20));
      if (!writer->Write(data)) break;
    }
    writer->WritesDone();
    return writer->Finish();
  }
  // A picture of one value everywhere but for the pixel in the middle.
  static std::string exr(int side, float value, float middle, const char* channels = "RGB", float variance = -1) {
    std::vector<float> plane(std::size_t(side) * std::size_t(side), value), noise(plane.size(), variance);
    plane[plane.size() / 2] = middle;
    std::vector<TileChannel> all;
    for (const char* c = channels; *c; ++c) all.push_back({std::string(1, *c), plane.data(), true});
    for (const char* c : {"variance.R", "variance.G", "variance.B"}) {
      if (variance >= 0) all.push_back({c, noise.data(), true});
    }
    const auto bytes =
        encode_tile({{0, 0, side, side}, side, side}, all, {TilePixelType::float32, TileCompression::zip});
    EXPECT_TRUE(bytes) << bytes.error().to_string();
    return {bytes->begin(), bytes->end()};
  }
  static double value_of(const pb::CompareUnit& unit, pb::CompareMeasure measure, const std::string& region = {}) {
    for (const pb::CompareValue& value : unit.values()) {
      if (value.measure() == measure && value.region() == region) return value.value();
    }
    return std::numeric_limits<double>::quiet_NaN();
  }

  std::string scene_;
};

TEST_F(CompareTest, TellsEveryUnitOnceAndTheTable) {
  start_with_scene();
  const Outcome outcome = run(request());
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  ASSERT_TRUE(outcome.messages.front().has_accepted());
  const auto& accepted = outcome.messages.front().accepted();
  EXPECT_EQ(accepted.units(), 8u);
  EXPECT_EQ(accepted.modes(0).settings().roulette_from(), 3);
  EXPECT_GT(accepted.threads(), 0);
  EXPECT_EQ(accepted.views_size(), 1);
  std::map<std::string, int> seen;
  std::map<std::uint64_t, std::string> seeds;
  for (const pb::CompareUnit& unit : outcome.units()) {
    EXPECT_EQ(++seen[unit.mode() + "/" + std::to_string(unit.seed_number()) + "/" + std::to_string(unit.budget())], 1);
    EXPECT_EQ(unit.samples(), unit.budget() == 0 ? 1 : 4);
    EXPECT_GT(unit.seconds(), 0);
    EXPECT_GE(unit.paths(), 24u * 24u * std::uint64_t(unit.samples()));
    EXPECT_TRUE(std::isfinite(value_of(unit, pb::COMPARE_MEASURE_RELMSE)));
    EXPECT_TRUE(std::isfinite(value_of(unit, pb::COMPARE_MEASURE_HDR_FLIP)));
    EXPECT_TRUE(std::isnan(value_of(unit, pb::COMPARE_MEASURE_FLICKER)));
    const std::string run = unit.mode() + std::to_string(unit.seed_number());
    EXPECT_EQ(seeds.emplace(unit.seed(), run).first->second, run) << "runs share a seed";
  }
  EXPECT_EQ(seen.size(), 8u);
  EXPECT_EQ(seeds.size(), 4u);
  ASSERT_TRUE(outcome.messages.back().has_result());
  EXPECT_EQ(outcome.result().table().points_size(), 4);
  EXPECT_GT(outcome.result().table().ratios_size(), 0);
  EXPECT_GT(outcome.result().table().sentences_size(), 0);
  ASSERT_EQ(outcome.references().size(), 1u);
  EXPECT_EQ(outcome.references()[0].noise(), pb::CompareResponse::Reference::NOISE_HALVES);
}

// A mode that is added later took no turns with those before.
TEST_F(CompareTest, TimesOfModesThatTookNoTurnsAreUndecided) {
  start_with_scene();
  pb::CompareRequest first = request();
  first.set_seeds(5);
  const auto apart = [](const Outcome& outcome) {
    int count = 0;
    for (const pb::CompareRatio& ratio : outcome.result().table().ratios()) {
      EXPECT_FALSE(ratio.different_calls() && ratio.kind() == pb::CompareRatio::KIND_EQUAL_SAMPLES);
      if (ratio.different_calls()) {
        EXPECT_EQ(ratio.verdict(), pb::COMPARE_VERDICT_UNDECIDED);
      }
      count += ratio.different_calls() && ratio.kind() == pb::CompareRatio::KIND_SPEED;
    }
    return count;
  };
  const Outcome together = run(first);
  ASSERT_TRUE(together.status.ok()) << together.status.error_message();
  EXPECT_EQ(apart(together), 0);
  pb::CompareRequest rest = first;
  for (const pb::CompareUnit& unit : together.units()) {
    if (unit.mode() == "first") *rest.add_done() = unit;
  }
  const Outcome added = run(rest);
  ASSERT_TRUE(added.status.ok()) << added.status.error_message();
  EXPECT_EQ(apart(added), 2) << "one of each budget";
}

TEST_F(CompareTest, GoesOnWithWhatIsDone) {
  start_with_scene();
  const Outcome whole = run(request());
  ASSERT_TRUE(whole.status.ok()) << whole.status.error_message();
  pb::CompareRequest rest = request();
  for (const pb::CompareUnit& unit : whole.units()) {
    if (unit.mode() == "first" || unit.seed_number() == 2) *rest.add_done() = unit;
  }
  const Outcome outcome = run(rest);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(outcome.messages.front().accepted().units_done(), 6u);
  const auto units = outcome.units();
  ASSERT_EQ(units.size(), 2u);
  for (const pb::CompareUnit& unit : units) {
    EXPECT_EQ(unit.mode(), "second");
    EXPECT_EQ(unit.seed_number(), 1u);
    // Units of the same seed have the same picture.
    for (const pb::CompareUnit& before : whole.units()) {
      if (before.mode() != unit.mode() || before.seed_number() != 1 || before.budget() != unit.budget()) continue;
      EXPECT_EQ(value_of(unit, pb::COMPARE_MEASURE_MSE), value_of(before, pb::COMPARE_MEASURE_MSE));
      EXPECT_EQ(unit.seed(), before.seed());
    }
  }
  const auto mean = [](const Outcome& o) { return o.result().table().points(0).values(0).value().mean(); };
  EXPECT_EQ(mean(outcome), mean(whole));

  for (const pb::CompareUnit& unit : units) *rest.add_done() = unit;
  const Outcome nothing = run(rest);
  ASSERT_TRUE(nothing.status.ok()) << nothing.status.error_message();
  EXPECT_TRUE(nothing.units().empty());
  EXPECT_TRUE(nothing.references().empty()) << "for nothing";
  EXPECT_EQ(mean(nothing), mean(whole));
}

TEST_F(CompareTest, PicturesAreThoseOfAJobWithTheUnitsSeed) {
  start_with_scene();
  pb::CompareRequest with_pictures = request();
  with_pictures.set_send_pictures(true);
  const Outcome outcome = run(with_pictures);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  const auto units = outcome.units();
  const auto unit = std::find_if(units.begin(), units.end(), [](const auto& u) {
    return u.mode() == "second" && u.seed_number() == 1 && u.budget() == 1;
  });
  ASSERT_NE(unit, units.end());
  std::vector<float> red;
  int references = 0;
  for (const auto& message : outcome.messages) {
    if (!message.has_picture()) continue;
    if (message.picture().reference()) {
      references += message.picture().last();
    } else if (message.picture().mode() == "second") {
      EXPECT_EQ(message.picture().budget(), 1u);
      const std::string& bytes = message.picture().tile().exr();
      const auto tile = decode_tile({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, 1 << 20);
      ASSERT_TRUE(tile);
      red.insert(red.end(), tile->find("R")->begin(), tile->find("R")->end());
    }
  }
  EXPECT_EQ(references, 1);
  ASSERT_EQ(red.size(), 24u * 24u);

  pb::RunJobRequest job;
  job.set_scene_id(scene_);
  *job.mutable_settings() = with_pictures.modes(1).settings();
  job.mutable_settings()->set_seed(unit->seed());
  job.mutable_budget()->set_samples(4);
  job.mutable_format()->set_pixel_type(pb::PIXEL_TYPE_FLOAT);
  grpc::ClientContext context;
  auto reader = stub().RunJob(&context, job);
  pb::RunJobResponse response;
  std::vector<float> expected;
  while (reader->Read(&response)) {
    if (!response.has_tile()) continue;
    const std::string& bytes = response.tile().exr();
    const auto tile = decode_tile({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, 1 << 20);
    ASSERT_TRUE(tile);
    expected = *tile->find("R");  // one tile is the whole picture
  }
  ASSERT_TRUE(reader->Finish().ok());
  EXPECT_EQ(red, expected);
}

TEST_F(CompareTest, RendersForMissingPicturesAlone) {
  start_with_scene();
  pb::CompareRequest with_pictures = request();
  with_pictures.set_send_pictures(true);
  const auto pictures = [](const Outcome& outcome) {
    EXPECT_TRUE(outcome.status.ok()) << outcome.status.error_message();
    std::vector<std::string> names;
    for (const auto& message : outcome.messages) {
      if (!message.has_picture() || !message.picture().last()) continue;
      names.push_back(message.picture().reference() ? "reference" : message.picture().mode());
    }
    return names;
  };
  const Outcome whole = run(with_pictures);
  EXPECT_EQ(pictures(whole), (std::vector<std::string>{"reference", "first", "second"}));
  pb::CompareRequest rest = with_pictures;
  for (const pb::CompareUnit& unit : whole.units()) *rest.add_done() = unit;
  EXPECT_EQ(pictures(run(rest)), (std::vector<std::string>{"reference", "first", "second"})) << "none is named";

  const auto add = [&](bool reference, const std::string& mode) {
    pb::CompareRequest::PictureName& name = *rest.add_pictures_done();
    name.set_reference(reference);
    name.set_mode(mode);
  };
  add(true, "");
  add(false, "first");
  const Outcome second = run(rest);
  EXPECT_EQ(pictures(second), std::vector<std::string>{"second"});
  EXPECT_TRUE(second.units().empty());
  const auto rendered = [](const Outcome& outcome) { return outcome.result().rendering_seconds(); };
  EXPECT_GT(rendered(second), 0);
  add(false, "second");
  const Outcome nothing = run(rest);
  EXPECT_TRUE(pictures(nothing).empty());
  EXPECT_EQ(rendered(nothing), 0);
  EXPECT_TRUE(nothing.references().empty()) << "for nothing";

  rest.mutable_done()->RemoveLast();
  EXPECT_TRUE(pictures(run(rest)).empty()) << "a unit that is missing is rendered without its picture";

  add(false, "second");
  add(true, "first");
  add(false, "");
  rest.mutable_pictures_done(0)->set_view(1);
  expect_status(
      run(rest).status, StatusCode::INVALID_ARGUMENT,
      {"pictures_done[0].view: 1; allowed: below 1", "pictures_done[3]: is there twice",
       "pictures_done[4].mode: 'first'; allowed: empty", "pictures_done[5].mode: ''; allowed: names of modes"});
  rest.set_send_pictures(false);
  expect_status(run(rest).status, StatusCode::INVALID_ARGUMENT, {"pictures_done: is given without send_pictures"});
}

// A path is rendered again as a whole, for what its modes carry over, but what is there is neither sent nor told again.
TEST_F(CompareTest, SendsTheMissingPictureOfAPath) {
  start_with_scene();
  pb::CompareRequest path = request();
  for (const double x : {0.0, 0.05, 0.1}) *path.add_views() = camera(x);
  path.set_seeds(1);
  path.set_send_pictures(true);
  const Outcome whole = run(path);
  ASSERT_TRUE(whole.status.ok()) << whole.status.error_message();
  for (const pb::CompareUnit& unit : whole.units()) *path.add_done() = unit;
  for (std::uint32_t view = 0; view < 3; ++view) {
    for (const char* mode : {"", "first", "second"}) {
      if (view == 1 && std::string(mode) == "first") continue;
      pb::CompareRequest::PictureName& name = *path.add_pictures_done();
      name.set_reference(*mode == 0);
      name.set_mode(mode);
      name.set_view(view);
    }
  }
  const Outcome rest = run(path);
  ASSERT_TRUE(rest.status.ok()) << rest.status.error_message();
  EXPECT_TRUE(rest.units().empty());
  int sent = 0;
  for (const auto& message : rest.messages) {
    if (!message.has_picture()) continue;
    sent += message.picture().last();
    EXPECT_EQ(message.picture().mode(), "first");
    EXPECT_EQ(message.picture().view(), 1u);
  }
  EXPECT_EQ(sent, 1);
}

TEST_F(CompareTest, PathsCarrySamplesOverAndTellFlicker) {
  start_with_scene();
  pb::CompareRequest path = request();
  path.mutable_modes(1)->mutable_settings()->set_mode(pb::MODE_REPROJECT);
  for (const double x : {0.0, 0.05, 0.1}) *path.add_views() = camera(x);
  path.clear_samples();
  path.add_samples(2);
  path.set_seeds(1);
  const Outcome outcome = run(path);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(outcome.references().size(), 3u);
  const auto units = outcome.units();
  ASSERT_EQ(units.size(), 6u);
  for (const pb::CompareUnit& unit : units) {
    EXPECT_EQ(std::isfinite(value_of(unit, pb::COMPARE_MEASURE_FLICKER)), unit.view() > 0);
    EXPECT_EQ(unit.reuse_share() > 0, unit.mode() == "second" && unit.view() > 0) << unit.mode() << unit.view();
  }
  EXPECT_EQ(std::count_if(outcome.result().table().points().begin(), outcome.result().table().points().end(),
                          [](const auto& point) { return point.all_views(); }),
            2);
}

TEST_F(CompareTest, PreviewsOfAPathAreMeasuredFromTheirViews) {
  start_with_scene();
  pb::CompareRequest path = request();
  path.mutable_modes(1)->set_picture(pb::COMPARED_PICTURE_PREVIEW);
  path.mutable_modes(1)->mutable_settings()->set_preview_rate(120);
  path.mutable_modes(1)->mutable_settings()->set_mode(pb::MODE_COMBINED);
  for (const double x : {0.0, 0.05, 0.1}) *path.add_views() = camera(x);
  path.clear_samples();
  path.add_samples(2);
  path.set_seeds(1);
  const Outcome outcome = run(path);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  int previews = 0;
  for (const pb::CompareUnit& unit : outcome.units()) {
    if (unit.mode() != "second" || unit.view() == 0) continue;
    ++previews;
    EXPECT_GT(unit.seconds(), 0);
    EXPECT_LT(value_of(unit, pb::COMPARE_MEASURE_RELMSE), 1);
  }
  EXPECT_EQ(previews, 2);
}

// A gaze goes to every view; parts of the picture have FLIP and flicker of their own.
TEST_F(CompareTest, FollowsAGazeAndTellsOfDisks) {
  start_with_scene();
  pb::CompareRequest path = request();
  for (pb::CompareMode& mode : *path.mutable_modes()) {
    mode.set_picture(pb::COMPARED_PICTURE_PREVIEW);
    mode.mutable_settings()->set_preview_rate(120);
    mode.mutable_settings()->set_mode(pb::MODE_COMBINED);
  }
  path.mutable_modes(0)->mutable_settings()->set_foveation(pb::FOVEATION_PAPER);
  path.mutable_modes(0)->mutable_settings()->set_preview_upscaling(true);
  path.mutable_modes(1)->mutable_settings()->set_foveation(pb::FOVEATION_DENSITY);
  for (const double x : {0.0, 0.05, 0.1}) *path.add_views() = camera(x);
  path.clear_samples();
  path.add_samples(2);
  path.set_seeds(1);
  path.mutable_gaze()->set_x(12);
  path.mutable_gaze()->set_y(12);
  for (const bool outside : {false, true}) {
    pb::CompareRegion& region = *path.add_regions();
    region.set_name(outside ? "around" : "fovea");
    region.mutable_disk()->set_x(12);
    region.mutable_disk()->set_y(12);
    region.mutable_disk()->set_radius(5);
    region.mutable_disk()->set_outside(outside);
  }
  const Outcome outcome = run(path);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  ASSERT_EQ(outcome.units().size(), 6u);
  for (const pb::CompareUnit& unit : outcome.units()) {
    const double whole = value_of(unit, pb::COMPARE_MEASURE_FLIP), fovea = value_of(unit, pb::COMPARE_MEASURE_FLIP, "fovea"),
                 around = value_of(unit, pb::COMPARE_MEASURE_FLIP, "around");
    EXPECT_NEAR(80 * fovea + (24 * 24 - 80) * around, 24 * 24 * whole, 0.01 * 24 * 24 * whole + 1e-6);
    for (const char* region : {"", "fovea", "around"}) {
      EXPECT_TRUE(std::isfinite(value_of(unit, pb::COMPARE_MEASURE_HDR_FLIP_MEDIAN, region))) << region;
      EXPECT_EQ(std::isfinite(value_of(unit, pb::COMPARE_MEASURE_FLICKER, region)), unit.view() > 0) << region;
    }
  }

  // Samples go where somebody looks: fewer on the whole.
  pb::CompareRequest still = request();
  still.mutable_modes(1)->mutable_settings()->set_foveation(pb::FOVEATION_DENSITY);
  still.mutable_gaze()->set_x(0);
  still.clear_samples();
  still.add_samples(32);
  for (const pb::CompareUnit& unit : run(still).units())
    EXPECT_EQ(unit.samples() < 0.9 * 32, unit.mode() == "second") << unit.samples();

  pb::CompareRequest bad = path;
  bad.mutable_gaze()->set_x(std::nan(""));
  bad.mutable_regions(0)->mutable_rect()->set_x1(3);
  bad.mutable_regions(0)->mutable_disk()->set_radius(0);
  bad.mutable_regions(1)->mutable_disk()->set_radius(100);
  expect_status(run(bad).status, StatusCode::INVALID_ARGUMENT,
                {"gaze.x: nan", "regions[0].disk: is given beside rect", "regions[0].disk.radius: 0; allowed: (0, 1000000]",
                 "regions[1].disk: has no pixel of the picture"});
}

TEST_F(CompareTest, TakesTheReferencesNoiseOff) {
  start_with_scene();
  pb::CompareRequest given = request();
  given.clear_modes();
  pb::CompareMode& mode = *given.add_modes();
  mode.set_name("only");
  mode.mutable_settings()->set_width(8);
  mode.mutable_settings()->set_height(8);
  mode.mutable_settings()->set_max_segments(1);
  // Pixels in the middle see the square alone, of radiance 1.
  pb::CompareRegion& region = *given.add_regions();
  region.set_name("square");
  region.mutable_rect()->set_x0(3);
  region.mutable_rect()->set_y0(3);
  region.mutable_rect()->set_x1(5);
  region.mutable_rect()->set_y1(5);
  pb::LoadReferenceResponse plain, noisy;
  ASSERT_TRUE(load_reference(exr(8, 1.5f, 1.5f), &plain).ok());
  EXPECT_FALSE(plain.has_variance());
  ASSERT_TRUE(load_reference(exr(8, 1.5f, 1.5f, "RGB", 0.125f), &noisy).ok());
  EXPECT_TRUE(noisy.has_variance());
  EXPECT_EQ(noisy.width(), 8);
  const auto mse = [&](const pb::LoadReferenceResponse& reference) {
    given.mutable_reference()->mutable_loaded()->clear_reference_ids();
    given.mutable_reference()->mutable_loaded()->add_reference_ids(reference.reference_id());
    const Outcome outcome = run(given);
    EXPECT_TRUE(outcome.status.ok()) << outcome.status.error_message();
    return outcome.units().empty() ? 0.0 : value_of(outcome.units()[0], pb::COMPARE_MEASURE_MSE, "square");
  };
  EXPECT_NEAR(mse(plain), 0.25, 1e-6);
  EXPECT_NEAR(mse(noisy), 0.125, 1e-6);
}

// As heliograph compare does when the daemon that rendered the reference is gone: it sends the kept picture.
TEST_F(CompareTest, GoesOnWithAKeptReferenceToTheSameValues) {
  start_with_scene();
  pb::CompareRequest given = request();
  given.mutable_reference()->mutable_rendered()->set_error(0.3);
  given.set_send_pictures(true);
  pb::CompareRegion& region = *given.add_regions();
  region.set_name("corner");
  region.mutable_rect()->set_x1(7);
  region.mutable_rect()->set_y1(9);
  const Outcome whole = run(given);
  ASSERT_TRUE(whole.status.ok()) << whole.status.error_message();
  std::map<std::string, std::vector<float>> planes;
  for (const auto& message : whole.messages) {
    if (!message.has_picture() || !message.picture().reference()) continue;
    const std::string& bytes = message.picture().tile().exr();
    const auto tile = decode_tile({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, 1 << 20);
    ASSERT_TRUE(tile) << tile.error().to_string();
    for (const char* name : {"R", "G", "B", "variance.R", "variance.G", "variance.B"}) {
      const std::vector<float>* rows = tile->find(name);
      ASSERT_NE(rows, nullptr) << name;
      planes[name].insert(planes[name].end(), rows->begin(), rows->end());
    }
  }
  std::vector<TileChannel> channels;
  for (const auto& [name, plane] : planes) channels.push_back({name, plane.data(), true});
  const auto bytes = encode_tile({{0, 0, 24, 24}, 24, 24}, channels, {TilePixelType::float32, TileCompression::zip});
  ASSERT_TRUE(bytes) << bytes.error().to_string();
  pb::LoadReferenceResponse kept;
  ASSERT_TRUE(load_reference({bytes->begin(), bytes->end()}, &kept).ok());
  ASSERT_TRUE(kept.has_variance());
  given.mutable_reference()->mutable_loaded()->add_reference_ids(kept.reference_id());
  const Outcome again = run(given);
  ASSERT_TRUE(again.status.ok()) << again.status.error_message();
  EXPECT_EQ(again.references()[0].noise(), pb::CompareResponse::Reference::NOISE_VARIANCE);
  EXPECT_NEAR(again.references()[0].error(), whole.references()[0].error(), 1e-6);

  const auto before = whole.units(), after = again.units();
  ASSERT_EQ(before.size(), after.size());
  int of_parts = 0;
  for (std::size_t u = 0; u < before.size(); ++u) {
    ASSERT_EQ(before[u].seed(), after[u].seed());
    ASSERT_EQ(before[u].values_size(), after[u].values_size());
    EXPECT_NE(before[u].call(), 0u);
    EXPECT_EQ(before[u].call(), before[0].call());
    EXPECT_EQ(after[u].call(), after[0].call());
    for (int i = 0; i < before[u].values_size(); ++i) {
      const pb::CompareValue &x = before[u].values(i), &y = after[u].values(i);
      ASSERT_EQ(x.measure(), y.measure());
      EXPECT_NEAR(x.value(), y.value(), 1e-6 * std::max(1e-3, std::abs(x.value())))
          << pb::CompareMeasure_Name(x.measure()) << " " << x.region();
      EXPECT_NEAR(x.reference_error(), y.reference_error(), 1e-6 * x.reference_error());
      EXPECT_EQ(x.reference_error() > 0, x.measure() == pb::COMPARE_MEASURE_BIAS);
      of_parts += !x.region().empty() && x.measure() == pb::COMPARE_MEASURE_RELMSE;
    }
  }
  EXPECT_EQ(of_parts, 2 * 8) << "the dark half and the corner";
  EXPECT_NE(before[0].call(), after[0].call());
}

TEST_F(CompareTest, RefusesBadReferences) {
  start_with_scene([](ServerConfig& config) { config.max_reference_memory = 12 * 64 * 64; });
  pb::LoadReferenceResponse loaded;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  expect_status(load_reference(exr(8, 1, nan), &loaded), StatusCode::INVALID_ARGUMENT, {"nan", "(0, 4)", "finite"});
  expect_status(load_reference(exr(8, 1, 1, "RG"), &loaded), StatusCode::INVALID_ARGUMENT, {"no channel B"});
  expect_status(load_reference(exr(8, 1, 1, "Y"), &loaded), StatusCode::INVALID_ARGUMENT, {"no channels R, G and B"});
  expect_status(load_reference("no picture", &loaded), StatusCode::INVALID_ARGUMENT, {"data"});
  expect_status(load_reference(exr(8, 1, 1), &loaded, std::string(32, 'x')), StatusCode::INVALID_ARGUMENT,
                {"begin.sha256"});
  expect_status(load_reference(exr(8, 1, 1), &loaded, "short"), StatusCode::INVALID_ARGUMENT, {"begin.sha256", "32"});
  expect_status(load_reference(exr(80, 1, 1), &loaded), StatusCode::RESOURCE_EXHAUSTED, {"max_reference_memory"});
  // One of another size than the modes', and one that was let go for another.
  ASSERT_TRUE(load_reference(exr(64, 1, 1), &loaded).ok());
  pb::CompareRequest compare = request();
  compare.mutable_reference()->mutable_loaded()->add_reference_ids(loaded.reference_id());
  expect_status(run(compare).status, StatusCode::INVALID_ARGUMENT, {"64 x 64", "24 x 24"});
  pb::LoadReferenceResponse other;
  ASSERT_TRUE(load_reference(exr(64, 2, 1), &other).ok());
  expect_status(run(compare).status, StatusCode::NOT_FOUND,
                {"reference.loaded.reference_ids[0]", "max_reference_memory"});
}

TEST_F(CompareTest, KeepsReferencesWithinTheirLimit) {
  // There is room for three pictures (two halves and their mean) of 24 x 24.
  start_with_scene([](ServerConfig& config) { config.max_reference_memory = 3 * 12 * 24 * 24; });
  pb::CompareRequest one = request(), two = request();
  one.set_seeds(1);
  two.set_seeds(1);
  two.mutable_reference()->mutable_rendered()->set_max_samples(64);
  const auto told = [&](const pb::CompareRequest& r) {
    const Outcome outcome = run(r);
    EXPECT_TRUE(outcome.status.ok()) << outcome.status.error_message();
    return outcome.references().empty() ? pb::CompareResponse::Reference() : outcome.references()[0];
  };
  EXPECT_FALSE(told(one).kept());
  EXPECT_TRUE(told(one).kept());
  EXPECT_FALSE(told(two).kept());
  const auto again = told(one);
  EXPECT_FALSE(again.kept());
  EXPECT_TRUE(again.rendered_again());
}

TEST_F(CompareTest, RefusesAllThatIsWrongTogether) {
  start_with_scene();
  pb::CompareRequest bad = request();
  bad.mutable_modes(0)->set_name("no spaces");
  bad.mutable_modes(1)->mutable_settings()->set_width(30);
  bad.mutable_modes(1)->mutable_settings()->set_max_segments(-1);
  bad.set_seeds(0);
  bad.add_samples(4);
  bad.add_times_s(1);
  bad.add_measures(pb::COMPARE_MEASURE_FLICKER);
  bad.mutable_reference()->mutable_rendered()->set_error(2);
  bad.set_worst_pixels(65);
  pb::CompareUnit& unit = *bad.add_done();
  unit.set_mode("third");
  unit.set_seed_number(1);
  unit.add_values()->set_measure(pb::COMPARE_MEASURE_BIAS);
  unit.mutable_values(0)->set_reference_error(-0.5);
  bad.mutable_modes(1)->set_picture(pb::COMPARED_PICTURE_PREVIEW);
  expect_status(run(bad).status, StatusCode::INVALID_ARGUMENT,
                {"modes[0].name", "no spaces", "modes[1].settings", "30 x 24", "max_segments", "seeds: 0", "samples",
                 "times_s", "measures[0]", "FLICKER", "reference.rendered.error", "worst_pixels", "done[0].mode",
                 "third", "done[0].values", "reference_error -0.5", "preview_rate", "PREVIEW of one view"});
  pb::CompareRequest nobody = request();
  nobody.set_scene_id("none");
  expect_status(run(nobody).status, StatusCode::NOT_FOUND, {"scene_id"});
  nobody.set_seeds(0);
  expect_status(run(nobody).status, StatusCode::INVALID_ARGUMENT, {"scene_id", "seeds"});
}

TEST_F(CompareTest, HasLimits) {
  start_with_scene([](ServerConfig& config) {
    config.max_compare_units = 8;
    config.max_compare_pixels = 4 * 24 * 24;
  });
  EXPECT_TRUE(run(request()).status.ok());
  pb::CompareRequest more = request();
  more.add_samples(8);
  expect_status(run(more).status, StatusCode::RESOURCE_EXHAUSTED,
                {"max_compare_units", "2 modes x 2 seeds x 3 budgets"});
  expect_status(run(request(25)).status, StatusCode::RESOURCE_EXHAUSTED, {"max_compare_pixels", "25 x 25"});
  pb::CompareRequest exclusive = request();
  exclusive.set_exclusive(true);
  expect_status(run(exclusive).status, StatusCode::PERMISSION_DENIED, {"exclusive", "allow-exclusive"});
}

TEST_F(CompareTest, CancellingEndsItAndTheNextOneRuns) {
  start_with_scene();
  pb::CompareRequest endless = request(256);
  endless.clear_samples();
  endless.add_samples(1u << 24);
  grpc::ClientContext context;
  auto reader = stub().Compare(&context, endless);
  pb::CompareResponse response;
  bool rendering = false;
  while (!rendering && reader->Read(&response))
    rendering = response.has_progress() && response.progress().doing() == "first";
  ASSERT_TRUE(rendering);
  // Another one waits for it.
  std::thread other([&] {
    const Outcome outcome = run(request());
    EXPECT_TRUE(outcome.status.ok()) << outcome.status.error_message();
    EXPECT_EQ(outcome.units().size(), 8u);
    EXPECT_EQ(outcome.messages.front().accepted().waits_for(), 1u);
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  context.TryCancel();
  while (reader->Read(&response)) {
  }
  EXPECT_EQ(reader->Finish().error_code(), StatusCode::CANCELLED);
  other.join();
}

// References are kept for later alone: who needs their memory gets it.
TEST_F(CompareTest, ReferencesMakeRoomForFilms) {
  start_with_scene([](ServerConfig& config) { config.max_memory = 40'000'000; });
  const Outcome outcome = run(request(300));
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  // Film and queue take 160 bytes a pixel, 37.2 MB, and the reference 36, 3.2 MB.
  pb::RunJobRequest job;
  job.set_scene_id(scene_);
  job.mutable_settings()->set_width(482);
  job.mutable_settings()->set_height(482);
  job.mutable_budget()->set_samples(1);
  grpc::ClientContext context;
  auto reader = stub().RunJob(&context, job);
  pb::RunJobResponse response;
  while (reader->Read(&response)) {
  }
  const grpc::Status status = reader->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  const Outcome again = run(request(300));
  ASSERT_TRUE(again.status.ok()) << again.status.error_message();
  EXPECT_TRUE(again.references()[0].rendered_again());
}

TEST_F(CompareTest, APathWhoseReferencesDoNotFitIsRefusedBeforeAnythingIsRendered) {
  start_with_scene([](ServerConfig& config) { config.max_memory = 24 << 20; });
  pb::CompareRequest path = request(160);
  for (int i = 0; i < 40; ++i) *path.add_views() = camera(0.01 * i);
  const Outcome outcome = run(path);
  expect_status(outcome.status, StatusCode::RESOURCE_EXHAUSTED, {"max_memory", "40 views"});
  EXPECT_TRUE(outcome.references().empty());
}

TEST_F(CompareTest, RefusesMoreUnitsThanAMessageHolds) {
  start_with_scene();
  pb::CompareRequest many = request();
  many.set_seeds(512);
  for (int i = 3; i <= 8; ++i) many.add_samples(2u << i);
  EXPECT_EQ(many.samples_size(), 8);
  for (int i = 0; i < 16; ++i) {
    pb::CompareRegion& region = *many.add_regions();
    region.set_name("region " + std::to_string(i));
    region.mutable_rect()->set_x1(8);
    region.mutable_rect()->set_y1(8);
  }
  expect_status(run(many).status, StatusCode::RESOURCE_EXHAUSTED, {"max_message_bytes", "8192 units"});
}

TEST_F(CompareTest, WhoGivesUpLeavesItsPlaceInTheQueue) {
  start_with_scene();
  pb::CompareRequest endless = request(256);
  endless.clear_samples();
  endless.add_samples(1u << 24);
  const auto open = [&](grpc::ClientContext& context) {
    auto reader = stub().Compare(&context, endless);
    pb::CompareResponse response;
    EXPECT_TRUE(reader->Read(&response)) << reader->Finish().error_message();
    return std::pair(std::move(reader), response.accepted().waits_for());
  };
  grpc::ClientContext first;
  auto [running, before] = open(first);
  EXPECT_EQ(before, 0u);
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<pb::CompareResponse>>> waiting;
  for (std::size_t i = 0; i < CompareCore::kMaxWaiting; ++i) {
    auto [reader, place] = open(*contexts.emplace_back(std::make_unique<grpc::ClientContext>()));
    EXPECT_EQ(place, i + 1);
    waiting.push_back(std::move(reader));
  }
  expect_status(run(endless).status, StatusCode::RESOURCE_EXHAUSTED, {"max_comparisons", "16"});
  contexts.front()->TryCancel();
  EXPECT_EQ(waiting.front()->Finish().error_code(), StatusCode::CANCELLED);
  // The daemon hears of it a little later.
  std::unique_ptr<grpc::ClientContext> late;
  std::unique_ptr<grpc::ClientReader<pb::CompareResponse>> reader;
  pb::CompareResponse response;
  const double deadline = now_s() + 10 * kPatience;
  for (bool taken = false; !taken;) {
    late = std::make_unique<grpc::ClientContext>();
    reader = stub().Compare(late.get(), endless);
    taken = reader->Read(&response);
    ASSERT_TRUE(taken || now_s() < deadline) << reader->Finish().error_message();
  }
  EXPECT_EQ(response.accepted().waits_for(), CompareCore::kMaxWaiting);
  // All end when the daemon drains, whether they run or wait.
  server_->drain(5);
  while (running->Read(&response)) {
  }
  expect_status(running->Finish(), StatusCode::UNAVAILABLE, {"draining"});
  EXPECT_FALSE(waiting.back()->Read(&response));
  expect_status(waiting.back()->Finish(), StatusCode::UNAVAILABLE, {"draining"});
  late->TryCancel();
  reader->Finish();
  for (std::size_t i = 1; i + 1 < waiting.size(); ++i) waiting[i]->Finish();
}

// Threads of no session hold every processor, while pictures of a tenth of a second are rendered.
TEST_F(CompareTest, OtherProgramsDisturbShortPictures) {
  const int worker = int(gettid());
  if (!waited_for_processor_s({&worker, 1})) GTEST_SKIP() << "the kernel does not tell for how long threads waited";
  start_with_scene();
  pb::CompareRequest timed = request(64);
  timed.clear_samples();
  timed.add_times_s(0.1);
  timed.mutable_reference()->mutable_rendered()->set_max_samples(2);
  std::atomic<bool> stop = false;
  std::vector<std::thread> others;
  for (unsigned i = 0; i < 2 * std::max(1u, std::thread::hardware_concurrency()); ++i)
    others.emplace_back([&] {
      while (!stop) continue;
    });
  const Outcome outcome = run(timed);
  stop = true;
  for (std::thread& other : others) other.join();
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  ASSERT_EQ(outcome.units().size(), 4u);
  for (const pb::CompareUnit& unit : outcome.units()) {
    EXPECT_LT(unit.seconds(), 1) << "too long to be short";
    EXPECT_TRUE(unit.disturbed()) << unit.others_share();
    EXPECT_GT(unit.others_share(), 0.2);
  }
}

TEST_F(CompareTest, ExclusiveTurnsLetOthersWait) {
  start_with_scene([](ServerConfig& config) { config.allow_exclusive = true; });
  const std::string session = create_session(scene_, 64, 64);
  StreamClient client(stub(), session);
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for_tiles(1));
  pb::CompareRequest timed = request(64);
  timed.clear_samples();
  timed.add_times_s(1);
  timed.set_seeds(1);
  timed.mutable_reference()->mutable_rendered()->set_max_samples(2);
  const auto shares = [&](bool exclusive) {
    timed.set_exclusive(exclusive);
    const double before = session_info(session).used_seconds();
    const Outcome outcome = run(timed);
    EXPECT_TRUE(outcome.status.ok()) << outcome.status.error_message();
    return std::pair(session_info(session).used_seconds() - before, outcome.result().disturbed());
  };
  const auto [beside, disturbed] = shares(false);
  EXPECT_TRUE(disturbed) << "a session that renders without end is beside it";
  EXPECT_GT(beside, 0.5);
  EXPECT_LT(shares(true).first, 0.5 * beside);
}

}  // namespace
}  // namespace helio::test
