// What pixels keep of their first samples for the paper's reprojection, and how they are copied.
#include "renderer/frame/paper/first_hits.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "renderer/film/core/packed_values.h"
#include "renderer/film/estimate/resolve.h"
#include "renderer/film/history/film_history.h"
#include "renderer/frame/paper/paper_film.h"

namespace helio {
namespace {

FirstHitSample sample_at(const V3f& position, const Rgb& irradiance = Rgb(0, 0, 0)) {
  FirstHitSample sample;
  sample.met = sample.directed = true;
  sample.position = position;
  sample.direction = V3f(0, 1, 0);
  sample.footprint = 0.025f;
  sample.irradiance = irradiance;
  return sample;
}

TEST(FirstHits, TheFirstSamplesOfBothHalvesAreStored) {
  for (const int per_pixel : {1, 4}) {
    FirstHits hits(2, 1, per_pixel);
    // As they are taken: A0, B0, then two more of each.
    hits.add(0, 0, 1, 1, 0, sample_at({1, 0, 0}));
    hits.add(1, 0, 1, 1, 0, sample_at({2, 0, 0}));
    hits.add(0, 1, 2, 1, 0, sample_at({3, 0, 0}));
    hits.add(0, 2, 3, 1, 0, sample_at({4, 0, 0}));
    hits.add(1, 1, 2, 1, 0, sample_at({5, 0, 0}));
    hits.add(1, 2, 3, 1, 0, sample_at({6, 0, 0}));
    const auto stored = hits.hits(1, 0);
    EXPECT_EQ(hits.pixel(1, 0).met, per_pixel == 1 ? 0b1 : 0b1111);
    EXPECT_EQ(hits.pixel(1, 0).directed, hits.pixel(1, 0).met);
    EXPECT_EQ(stored[0].position.x, 1);
    EXPECT_LT(length(unpack_direction(stored[0].direction) - V3f(0, 1, 0)), 1e-4f);
    if (per_pixel == 4) {
      EXPECT_EQ(stored[1].position.x, 2);
      EXPECT_EQ(stored[2].position.x, 3);
      EXPECT_EQ(stored[3].position.x, 5);
    }
    EXPECT_EQ(hits.pixel(0, 0).met, 0);
  }
}

TEST(FirstHits, IrradianceIsTheMeanOfEachHalf) {
  FirstHits hits(1, 1, 1);
  for (std::uint32_t i = 0; i < 4; ++i) {
    hits.add(0, i, i + 1, 0, 0, sample_at({0, 0, 0}, Rgb(float(i), 1, 0)));  // 0, 1, 2, 3
    hits.add(1, i, i + 1, 0, 0, sample_at({0, 0, 0}, Rgb(5, 0, 0)));
  }
  EXPECT_NEAR(hits.pixel(0, 0).irradiance[0][0], 1.5f, 1e-6f);
  EXPECT_NEAR(hits.pixel(0, 0).irradiance[0][1], 1, 1e-6f);
  EXPECT_NEAR(hits.pixel(0, 0).irradiance[1][0], 5, 1e-6f);
}

TEST(FirstHits, TheDistanceTestMarksPixelsThatShowTwoDepths) {
  // Pixels of 0.025: points up to 0.2 apart are near.
  const auto edge = [](const FirstHitSample& first, const FirstHitSample& second) {
    FirstHits hits(1, 1, 1);
    hits.add(0, 0, 1, 0, 0, first);
    EXPECT_FALSE(hits.pixel(0, 0).edge);
    hits.add(1, 0, 1, 0, 0, second);
    return hits.pixel(0, 0).edge;
  };
  const FirstHitSample nothing;
  EXPECT_FALSE(edge(sample_at({0, 0, 0}), sample_at({0.199f, 0, 0})));
  EXPECT_TRUE(edge(sample_at({0, 0, 0}), sample_at({0, 0.201f, 0})));
  EXPECT_TRUE(edge(sample_at({0, 0, 0}), nothing));
  EXPECT_TRUE(edge(nothing, sample_at({0, 0, 0})));
  EXPECT_FALSE(edge(nothing, nothing));
  EXPECT_TRUE(edge(sample_at({0, 0, 0}), sample_at({std::numeric_limits<float>::quiet_NaN(), 0, 0})));
}

TEST(FirstHits, WhatCameWithAPixelIsNotReplaced) {
  FirstHits hits(1, 1, 4);
  hits.add(0, 0, 1, 0, 0, sample_at({1, 0, 0}));
  hits.pixel(0, 0).settled = true;
  hits.add(0, 0, 2, 0, 0, sample_at({1.1f, 0, 0}));
  hits.add(1, 0, 1, 0, 0, sample_at({1.1f, 0, 0}));
  EXPECT_EQ(hits.pixel(0, 0).met, 0b1);
  EXPECT_EQ(hits.hits(0, 0)[0].position.x, 1);
  EXPECT_FALSE(hits.pixel(0, 0).edge);
  hits.add(1, 1, 2, 0, 0, sample_at({2, 0, 0}));  // what the new camera sees through it counts all the same
  EXPECT_TRUE(hits.pixel(0, 0).edge);
}

// A 3 x 1 film whose pixel x has 2 + x samples of x in half A and one of 10 + x in half B.
Film three_pixels() {
  Film film(3, 1, paper_film_state({.targets = true, .history = true}, 1));
  for (int x = 0; x < 3; ++x) {
    for (int i = 0; i < 2 + x; ++i) film.half(0, x, 0).add(Rgb(float(x), 0, 0));
    film.half(1, x, 0).add(Rgb(10 + float(x), 0, 0));
    paper_film(film).first_hits()->add(0, 0, 1, x, 0, sample_at({float(x), 0, 0}, Rgb(1, 2, 3)));
    paper_film(film).probability(x, 0) = 0.25f * float(x);
  }
  return film;
}

// More samples than a carried pixel has digits for are taken for fewer, of the same mean and variance.
TEST(LeftPicture, CountsHaveALimit) {
  Film film(1, 1, paper_film_state({.history = true}, 1));
  constexpr std::uint32_t kCount = 100'000'000;
  HalfPixel& half = film.half(0, 0, 0);
  half.count = kCount;
  half.sum[1] = 3.0 * kCount;
  half.deviations[1] = 2.0f * kCount;
  LeftPicture& left = paper_film(film).first_hits()->left();
  left.gather(film, film.bounds());
  left.bid(0, 0, 1, 0, 0);
  film.clear();
  EXPECT_EQ(left.place(film, 0, 0), CarriedPixel::kMostCount);
  const HalfPixel& placed = film.half(1, 0, 0);
  EXPECT_EQ(placed.count, CarriedPixel::kMostCount);
  EXPECT_NEAR(placed.sum[1] / placed.count, 3, 1e-9);
  EXPECT_NEAR(placed.deviations[1] / placed.count, 2, 1e-6);
  EXPECT_EQ(film.attempted(1, 0, 0), 0u);
}

TEST(LeftPicture, CountsColourAndProbabilityTravelWithThePixel) {
  Film film = three_pixels();
  LeftPicture& left = paper_film(film).first_hits()->left();
  left.gather(film, film.bounds());
  left.bid(0, 0, 2.5f, 2, 0);
  film.clear();
  EXPECT_EQ(left.place(film, 0, 0), 5u);  // 4 and 1
  EXPECT_EQ(left.place(film, 1, 0), 0u);  // nobody asked
  // Halves change places.
  EXPECT_EQ(film.half(1, 0, 0).count, 4u);
  EXPECT_EQ(film.half(1, 0, 0).sum[0], 8);
  EXPECT_EQ(film.half(0, 0, 0).count, 1u);
  EXPECT_EQ(film.half(0, 0, 0).sum[0], 12);
  EXPECT_EQ(resolve_mean(film, 0, 0).x, 7);
  EXPECT_EQ(paper_film(film).first_hits()->pixel(0, 0).irradiance[1][2], 3);
  EXPECT_EQ(paper_film(film).first_hits()->pixel(0, 0).irradiance[0][2], 0);
  EXPECT_EQ(paper_film(film).first_hits()->hits(0, 0)[0].position.x, 2);
  EXPECT_TRUE(paper_film(film).first_hits()->pixel(0, 0).settled);
  EXPECT_EQ(paper_film(film).probability(0, 0), 0.5f);
  EXPECT_EQ(film.features(0, 0).depth, 2.5f);
  // All of it was carried: the next sample is the first of this picture, and no bound is known.
  for (int h = 0; h < kHalves; ++h) EXPECT_EQ(film.attempted(h, 0, 0), 0u);
  EXPECT_EQ(film.history()->weight(0, 0, 1, 4), 1);
  EXPECT_EQ(film.history()->bias2(0, 0, 1, 4), 0);
  EXPECT_EQ(film.history()->carried(0, 0).age, 1);
  film.half(0, 0, 0).add(Rgb(0, 0, 0));
  EXPECT_EQ(film.attempted(0, 0, 0), 1u);
  EXPECT_EQ(film.half(1, 1, 0).count, 0u);

  // On the next move: half of A's two samples were carried, all of B's. Age: 1 move of 0.75 of it, and one more.
  left.gather(film, film.bounds());
  left.bid(1, 0, 2.5f, 0, 0);
  film.clear();
  left.place(film, 1, 0);
  EXPECT_NEAR(film.history()->carried(1, 0).age, 1.75f, 0.06f);
}

TEST(LeftPicture, TheNearestGetsThePixelAndThenTheFirst) {
  struct Bid {
    float distance;
    int from;
    double sum;  // of pixel `from` in half A: x (2 + x)
  };
  std::vector<Bid> bids = {{3, 0, 0}, {2, 2, 8}, {2, 1, 3}};
  std::sort(bids.begin(), bids.end(), [](const Bid& a, const Bid& b) { return a.from < b.from; });
  do {
    Film film = three_pixels();
    LeftPicture& left = paper_film(film).first_hits()->left();
    left.gather(film, film.bounds());
    for (const Bid& bid : bids) left.bid(1, 0, bid.distance, bid.from, 0);
    film.clear();
    left.place(film, 1, 0);
    EXPECT_EQ(film.half(1, 1, 0).sum[0], 3);
  } while (std::next_permutation(bids.begin(), bids.end(), [](const Bid& a, const Bid& b) { return a.from < b.from; }));
}

}  // namespace
}  // namespace helio
