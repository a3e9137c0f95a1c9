// Modes that carry pictures over, and the channels that tell of it and of counts that differ, over the wire.
#include <algorithm>
#include <cmath>

#include "renderer/codec/tile_codec.h"
#include "service_fixture.h"

namespace helio::test {
namespace {

using grpc::StatusCode;

constexpr int kWidth = 80, kHeight = 60;
constexpr std::uint32_t kSamples = 32;

class ReuseTest : public ServiceTest {
 protected:
  // One picture: its end, and the planes that its final tiles make up.
  struct Shown {
    pb::FrameEnd end;
    std::vector<float> samples, weight, bound, age, density;

    double mean_of(const std::vector<float>& plane) const {
      double sum = 0;
      for (const float value : plane) sum += value;
      return sum / double(plane.size());
    }
  };

  void SetUp() override {
    start();
    Upload upload;
    upload.bytes = quad_gltf(0.25);
    upload.environment = "0.1,0.2,0.3";
    pb::LoadSceneResponse response;
    ASSERT_TRUE(load(upload.messages(), &response).ok());
    scene_ = response.scene().scene_id();
  }

  grpc::Status open_session(const pb::RenderSettings& settings, std::string* id) {
    pb::CreateSessionRequest request;
    request.set_scene_id(scene_);
    *request.mutable_settings() = settings;
    request.mutable_budget()->set_samples(kSamples);
    pb::CreateSessionResponse response;
    const grpc::Status status = create(request, &response);
    *id = response.session_id();
    EXPECT_TRUE(!status.ok() || response.settings().mode() == settings.mode());
    if (status.ok() && settings.has_reprojection() && settings.variant() != pb::VARIANT_PAPER) {
      EXPECT_EQ(response.settings().reprojection().mapping(), settings.reprojection().mapping());
    }
    return status;
  }

  static pb::RenderSettings settings_of(pb::Mode mode) {
    pb::RenderSettings settings;
    settings.set_width(kWidth);
    settings.set_height(kHeight);
    settings.set_mode(mode);
    return settings;
  }

  static Shown picture(const std::vector<pb::StreamResponse>& messages, std::uint64_t view_id) {
    Shown shown;
    for (const auto& message : messages) {
      if (message.has_frame_end() && message.frame_end().tag().view_id() == view_id) shown.end = message.frame_end();
      if (!message.has_tile() || !message.tile().final() || message.tile().tag().view_id() != view_id) continue;
      const std::string& exr = message.tile().exr();
      const auto tile = decode_tile({reinterpret_cast<const std::uint8_t*>(exr.data()), exr.size()}, 1 << 20);
      EXPECT_TRUE(tile.ok());
      if (!tile) continue;
      const auto append = [&](const char* name, std::vector<float>& plane) {
        const std::vector<float>* from = tile->find(name);
        EXPECT_TRUE(from) << name;
        if (from) plane.insert(plane.end(), from->begin(), from->end());
      };
      append("samples", shown.samples);
      append("history.weight", shown.weight);
      append("bias.bound", shown.bound);
      append("history.age", shown.age);
      append("samples.density", shown.density);
    }
    EXPECT_EQ(shown.weight.size(), std::size_t(kWidth * kHeight));
    return shown;
  }

  // Two views of a session, each rendered to its budget.
  std::vector<Shown> two_views(pb::Mode mode, pb::PixelType type = pb::PIXEL_TYPE_HALF) {
    return two_views(settings_of(mode), type);
  }
  std::vector<Shown> two_views(const pb::RenderSettings& settings, pb::PixelType type) {
    std::string session;
    EXPECT_TRUE(open_session(settings, &session).ok());
    StreamClient client(stub());
    pb::StreamRequest open;
    open.mutable_open()->set_session_id(session);
    pb::TileFormat& format = *open.mutable_open()->mutable_format();
    format.set_pixel_type(type);
    format.set_history(true);
    format.set_density(true);
    client.send(open);
    client.start_reading();
    std::vector<Shown> shown;
    for (const std::uint64_t id : {1, 2}) {
      client.send(view(id, 0.05 * double(id)));
      EXPECT_TRUE(client.reader().wait_for_frame_end(id));
      shown.push_back(picture(client.reader().messages(), id));
    }
    return shown;
  }

  static double seconds_of(const pb::FrameEnd& end, const std::string& pass) {
    for (const pb::PassTime& time : end.passes()) {
      if (time.pass() == pass) return time.seconds();
    }
    return 0;
  }

  std::string scene_;
};

TEST_F(ReuseTest, TheSecondViewSaysWhatTheFirstBroughtIt) {
  for (const pb::PixelType type : {pb::PIXEL_TYPE_HALF, pb::PIXEL_TYPE_FLOAT}) {
    const auto shown = two_views(pb::MODE_REPROJECT, type);
    EXPECT_EQ(shown[0].end.totals().reuse_share(), 0);
    EXPECT_EQ(shown[0].mean_of(shown[0].weight), 0);
    EXPECT_EQ(shown[0].mean_of(shown[0].bound), 0);

    const Shown& second = shown[1];
    EXPECT_GT(second.end.totals().reuse_share(), 0.2) << "most pixels see what they saw before";
    EXPECT_LT(second.end.totals().reuse_share(), 1);
    EXPECT_GE(second.end.totals().verification_rays(), std::uint64_t(kWidth * kHeight));
    EXPECT_GT(seconds_of(second.end, "reproject"), 0);
    EXPECT_GT(seconds_of(second.end, "integrate"), 0);
    double carried = 0, samples = 0;
    for (std::size_t i = 0; i < second.weight.size(); ++i) {
      const float weight = second.weight[i];
      ASSERT_GE(weight, 0);
      ASSERT_LE(weight, 1);
      ASSERT_GE(second.bound[i], 0);
      ASSERT_TRUE(std::isfinite(second.bound[i]));
      ASSERT_NEAR(second.age[i], weight, 1e-3) << "what was carried was traced one move ago";
      ASSERT_EQ(second.density[i], 1) << "counts do not differ";
      // Fresh ones are the same number everywhere.
      // Halves weigh alike, though one may carry a few samples more than the other.
      EXPECT_NEAR(double(second.samples[i]) * (1 - weight), kSamples, 0.05 * kSamples);
      carried += double(weight) * second.samples[i];
      samples += second.samples[i];
    }
    EXPECT_NEAR(carried / samples, second.end.totals().reuse_share(), 1e-3);
  }
}

TEST_F(ReuseTest, AsPublishedNoBoundIsKnown) {
  for (const pb::Mode mode : {pb::MODE_REPROJECT, pb::MODE_COMBINED}) {
    pb::RenderSettings settings = settings_of(mode);
    settings.set_variant(pb::VARIANT_PAPER);
    settings.mutable_reprojection()->set_stored_hits(4);
    // The even sky gets as few samples as may be: at 2 of 4, not 4 of 32, the mean that ends the frame takes 64
    // iterations and not 250.
    settings.mutable_adaptive()->set_min_samples(2);
    settings.mutable_adaptive()->set_max_samples(4);
    const auto shown = two_views(settings, pb::PIXEL_TYPE_FLOAT);
    ASSERT_FALSE(shown[1].weight.empty());
    EXPECT_EQ(shown[0].end.totals().reuse_share(), 0);
    const Shown& second = shown[1];
    EXPECT_GT(second.end.totals().reuse_share(), 0.1) << "of the square; the sky starts over";
    EXPECT_GT(second.end.totals().verification_rays(), 0u);
    EXPECT_GT(seconds_of(second.end, "reproject"), 0);
    EXPECT_EQ(seconds_of(second.end, "review"), 0);
    EXPECT_EQ(*std::max_element(second.bound.begin(), second.bound.end()), 0);
    double carried = 0, samples = 0;
    for (std::size_t i = 0; i < second.weight.size(); ++i) {
      ASSERT_GE(second.weight[i], 0);
      ASSERT_LE(second.weight[i], 1);
      ASSERT_NEAR(second.age[i], second.weight[i], 1e-3);
      carried += second.weight[i] > 0;
      samples += second.samples[i];
    }
    EXPECT_GT(carried, 0.05 * kWidth * kHeight);
    EXPECT_GT(samples, double(kSamples) * kWidth * kHeight);
  }
}

TEST_F(ReuseTest, DensityIsThatOfTheFreshSamples) {
  for (const pb::Mode mode : {pb::MODE_ADAPTIVE, pb::MODE_COMBINED}) {
    for (const Shown& shown : two_views(mode, pb::PIXEL_TYPE_FLOAT)) {
      EXPECT_NEAR(shown.mean_of(shown.density), 1, 1e-5);
      EXPECT_GT(*std::max_element(shown.density.begin(), shown.density.end()), 2) << "the square's edges";
      EXPECT_GT(seconds_of(shown.end, "allocate"), 0);
      // Where nothing was carried all samples are fresh: density times the mean, which the report rounds.
      double mean = 0;
      for (std::size_t i = 0; i < shown.samples.size(); ++i) {
        if (shown.weight[i] > 0) continue;
        ASSERT_GT(shown.density[i], 0);
        if (mean == 0) mean = double(shown.samples[i]) / shown.density[i];
        ASSERT_NEAR(shown.samples[i], shown.density[i] * mean, 1e-4 * shown.samples[i]);
      }
      EXPECT_EQ(shown.end.totals().samples_per_pixel(), std::uint32_t(mean + 0.5));
    }
  }
}

TEST_F(ReuseTest, ModesThatCarryNothingOverHaveEmptyChannels) {
  const auto shown = two_views(pb::MODE_PT);
  EXPECT_EQ(shown[1].end.totals().reuse_share(), 0);
  EXPECT_EQ(shown[1].end.totals().verification_rays(), 0u);
  for (const auto* plane : {&shown[1].weight, &shown[1].bound, &shown[1].age}) EXPECT_EQ(shown[1].mean_of(*plane), 0);
  EXPECT_EQ(*std::min_element(shown[1].density.begin(), shown[1].density.end()), 1);
  EXPECT_EQ(*std::max_element(shown[1].density.begin(), shown[1].density.end()), 1);
}

TEST_F(ReuseTest, WhatTheModeDoesNotHaveIsRefusedByName) {
  std::string session;
  for (const pb::Mode mode : {pb::MODE_REPROJECT, pb::MODE_COMBINED}) {
    pb::RenderSettings settings = settings_of(mode);
    settings.set_variant(pb::VARIANT_PAPER);
    settings.mutable_reprojection()->set_stored_hits(0xffffffffu);
    settings.mutable_reprojection()->set_max_error(-1);
    expect_status(
        open_session(settings, &session), StatusCode::INVALID_ARGUMENT,
        {"settings.reprojection.stored_hits", "allowed: 1, 4", "settings.reprojection.max_error: -1", "(0, 1000000]"});
  }
  pb::RenderSettings settings = settings_of(pb::MODE_COMBINED);
  settings.mutable_adaptive()->set_min_samples(3);
  expect_status(open_session(settings, &session), StatusCode::INVALID_ARGUMENT, {"settings.adaptive.min_samples"});
  settings = settings_of(pb::MODE_COMBINED);
  settings.mutable_reprojection()->set_mapping(pb::ReprojectionMapping(3));
  expect_status(open_session(settings, &session), StatusCode::INVALID_ARGUMENT,
                {"settings.reprojection.mapping: 3; allowed: REPROJECTION_MAPPING_REVERSE (1), or 0"});
  settings.mutable_reprojection()->set_mapping(pb::REPROJECTION_MAPPING_FORWARD);
  expect_status(
      open_session(settings, &session), StatusCode::INVALID_ARGUMENT,
      {"settings.reprojection.mapping: REPROJECTION_MAPPING_FORWARD (2); allowed: REPROJECTION_MAPPING_REVERSE (1)"});
  expect_status(open_session(settings_of(pb::Mode(5)), &session), StatusCode::INVALID_ARGUMENT,
                {"settings.mode: unknown value 5", "MODE_REPROJECT (3)", "MODE_COMBINED (4)"});
}

}  // namespace
}  // namespace helio::test
