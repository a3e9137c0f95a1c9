#include "server/state/scene_recipe.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "server/state/scene_recipe.pb.h"
#include "server/state/sealed_message.h"

namespace helio::test {
namespace {

SceneRecipe full_recipe() {
  SceneRecipe recipe;
  recipe.scene_id = "scene";
  recipe.loaded_id = "loaded";
  recipe.time_s = 0.1 + 0.2;
  recipe.animation = "walk";
  recipe.environment = "sky.exr";
  recipe.main_file = "/scenes/\xff\xfe not utf-8 \x01.gltf";
  recipe.files[recipe.main_file].fill(0x11);
  recipe.files["/scenes/b.bin"] = {1, 2, 3, 0xff};
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      recipe.changes.transforms[70000].from[i][j] = 1.0 / (3 + i * 4 + j);
      recipe.changes.transforms[70000].to[i][j] = i == 3 ? 1e300 * (j - 1.5) : -1e-300 / (1 + j);
    }
  }
  recipe.changes.transforms[70000].to[0][0] = -0.0;
  recipe.changes.transforms[70000].to[0][1] = std::numeric_limits<double>::denorm_min();
  recipe.changes.materials[3] = {{{0.1f, 0.2f, 0.3f}, {0, 0, 0}, 0.7f}, {{1, 1, 1}, {1e30f, 3.3f, 0}, 1e-7f}};
  recipe.changes.lights[0] = {{1, 2, 3}, {std::numeric_limits<float>::max(), 0.1f, 0}};
  recipe.changes.environment = Changed<Rgb>{{1, 1, 1}, {0.1f, 0.7f, 1e-40f}};
  return recipe;
}

void expect_equal(const SceneRecipe& a, const SceneRecipe& b) {
  EXPECT_EQ(a.scene_id, b.scene_id);
  EXPECT_EQ(a.loaded_id, b.loaded_id);
  EXPECT_EQ(a.time_s, b.time_s);
  EXPECT_EQ(a.animation, b.animation);
  EXPECT_EQ(a.environment, b.environment);
  EXPECT_EQ(a.main_file, b.main_file);
  EXPECT_EQ(a.files, b.files);
  EXPECT_EQ(a.upload, b.upload);
  ASSERT_EQ(a.changes.transforms.size(), b.changes.transforms.size());
  for (const auto& [index, change] : a.changes.transforms) {
    const auto other = b.changes.transforms.at(index);
    EXPECT_EQ(std::memcmp(&change, &other, sizeof(change)), 0) << index;
  }
  ASSERT_EQ(a.changes.materials.size(), b.changes.materials.size());
  for (const auto& [index, change] : a.changes.materials) {
    EXPECT_EQ(change.from, b.changes.materials.at(index).from);
    EXPECT_EQ(change.to, b.changes.materials.at(index).to);
  }
  ASSERT_EQ(a.changes.lights.size(), b.changes.lights.size());
  for (const auto& [index, change] : a.changes.lights) {
    EXPECT_EQ(change.from, b.changes.lights.at(index).from);
    EXPECT_EQ(change.to, b.changes.lights.at(index).to);
  }
  ASSERT_EQ(a.changes.environment.has_value(), b.changes.environment.has_value());
  if (!a.changes.environment) return;
  EXPECT_EQ(a.changes.environment->from, b.changes.environment->from);
  EXPECT_EQ(a.changes.environment->to, b.changes.environment->to);
}

TEST(SceneRecipe, KeepsEveryBit) {
  for (const SceneRecipe& recipe : {full_recipe(), SceneRecipe()}) {
    const auto decoded = decode_recipe(encode_recipe(recipe));
    ASSERT_TRUE(decoded) << decoded.error().to_string();
    expect_equal(*decoded, recipe);
  }
}

TEST(SceneRecipe, NoticesEveryCutAndEveryBit) {
  const std::vector<std::uint8_t> bytes = encode_recipe(full_recipe());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(decode_recipe(std::span(bytes).first(size))) << size;
  }
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    std::vector<std::uint8_t> flipped = bytes;
    flipped[bit / 8] ^= std::uint8_t(1 << bit % 8);
    EXPECT_FALSE(decode_recipe(flipped)) << bit;
  }
}

// The message of bytes that encode_recipe() made, and what decode_recipe() says of another.
heliograph::kept::SceneRecipe message_of(const std::vector<std::uint8_t>& bytes) {
  heliograph::kept::SceneRecipe message;
  EXPECT_TRUE(unseal(bytes, 2, message).ok());
  return message;
}
std::string told_of(const heliograph::kept::SceneRecipe& message) {
  const auto decoded = decode_recipe(seal(message, 2));
  return decoded ? "" : decoded.error().to_string();
}

TEST(SceneRecipe, RefusesNumbersAndHashesThatAreNotWhole) {
  const auto whole = message_of(encode_recipe(full_recipe()));
  EXPECT_EQ(told_of(whole), "");
  auto changed = whole;
  changed.mutable_transforms(0)->mutable_to()->RemoveLast();
  EXPECT_EQ(told_of(changed), "is damaged: matrices of object 70000 have 16 and 15 numbers; allowed: 16");
  changed = whole;
  changed.mutable_transforms(0)->add_from(1);
  EXPECT_EQ(told_of(changed), "is damaged: matrices of object 70000 have 17 and 16 numbers; allowed: 16");
  changed = whole;
  changed.mutable_files(1)->mutable_sha256()->pop_back();
  EXPECT_EQ(told_of(changed), "is damaged: a SHA-256 has 31 bytes; allowed: 32");
}

// As daemons before wrote it, in CBOR: {"animation": ...} with 13 entries.
TEST(SceneRecipe, TellsAnotherVersion) {
  const std::vector<std::uint8_t> cbor = {0xad, 0x69, 'a', 'n', 'i', 'm', 'a', 't', 'i', 'o', 'n', 0x60};
  const auto old = decode_recipe(cbor);
  ASSERT_FALSE(old);
  EXPECT_EQ(old.error().to_string(), "has version 1; this program reads version 2");
  const auto newer = decode_recipe(seal(message_of(encode_recipe(full_recipe())), 3));
  ASSERT_FALSE(newer);
  EXPECT_EQ(newer.error().to_string(), "has version 3; this program reads version 2");
}

TEST(SceneRecipe, BlobsAreThoseOfUploads) {
  SceneRecipe recipe;
  recipe.files["a"].fill(2);
  recipe.files["b"].fill(1);
  recipe.files["c"].fill(2);
  EXPECT_TRUE(recipe.blobs().empty());
  recipe.upload = true;
  ASSERT_EQ(recipe.blobs().size(), 2u);
  EXPECT_EQ(recipe.blobs()[0].substr(0, 4), "0101");
  EXPECT_EQ(recipe.blobs()[1].substr(60), "0202");
}

}  // namespace
}  // namespace helio::test
