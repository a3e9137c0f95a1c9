#include "renderer/frame/variant_parts.h"

#include <gtest/gtest.h>

#include "renderer/frame/stages/allocate.h"

namespace helio {
namespace {

TEST(VariantParts, AreThoseOfModesThatHaveVariants) {
  for (const RenderMode mode : kEveryRenderMode) {
    RenderSettings settings;
    settings.mode = mode;
    EXPECT_EQ(variant_parts(settings), nullptr) << to_string(mode);
    EXPECT_EQ(film_state(settings).extension, nullptr) << to_string(mode);
    settings.variant = ModeVariant::paper;
    const bool has = mode != RenderMode::pt;
    EXPECT_EQ(variant_parts(settings) != nullptr, has) << to_string(mode);
    EXPECT_EQ(film_state(settings).extension != nullptr, has) << to_string(mode);
    EXPECT_EQ(film_state(settings).carried_only, has && reuses(mode)) << to_string(mode);
    EXPECT_EQ(film_state(settings).exact_counts, has && allocates(mode)) << to_string(mode);
    EXPECT_EQ(allocation_settings(settings).has_value() && allocation_settings(settings)->iterates, allocates(mode))
        << to_string(mode);
  }
}

}  // namespace
}  // namespace helio
