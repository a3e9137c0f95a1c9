#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "client/environment_text.h"
#include "client/gltf_uris.h"
#include "client/local_scene.h"
#include "client/server_address.h"
#include "process.h"

namespace helio::test {
namespace {

std::vector<std::string> names_of(const LocalScene& scene) {
  std::vector<std::string> names;
  for (const LocalSceneFile& file : scene.files) names.push_back(file.name);
  return names;
}

using Names = std::vector<std::string>;

TEST(GltfUris, FindsEveryUriOnce) {
  std::istringstream json(R"({"buffers": [{"uri": "a.bin"}, {"uri": "data:,x"}], "images": [{"uri": "b%20c.png"},
    {"uri": "a.bin"}, {"bufferView": 1}], "name": "uri", "extras": {"heliograph": {"environment": {"image": "sky.exr"}}}})");
  EXPECT_EQ(find_gltf_uris(json), (Names{"a.bin", "b%20c.png", "sky.exr"}));
}

TEST(GltfUris, BrokenJsonGivesWhatCameBefore) {
  std::istringstream json(R"({"buffers": [{"uri": "a.bin"}], "images": [{"uri")");
  EXPECT_EQ(find_gltf_uris(json), Names{"a.bin"});
}

TEST(GltfUris, ResolvesLikeTheLoader) {
  EXPECT_EQ(relative_path_of("./textures/../a%20b.png"), "a b.png");
  EXPECT_EQ(relative_path_of("100%.png"), "100%.png");
}

TEST(GltfUris, NothingLeavesTheFolder) {
  for (const char* uri : {"../x.png", "a/../../x.png", "/etc/passwd", "%2Fetc/passwd", "..%2fx", "file:///etc/passwd",
                          "http://example.org/x.png", "C:\\x.png", "a\\b.png", "", ".", "a/"}) {
    EXPECT_FALSE(relative_path_of(uri)) << uri;
  }
}

TEST(MitsubaFiles, FollowsIncludesParametersAndPaths) {
  const TemporaryFolder folder;
  write_file(folder / "secret.png", "secret");
  write_file(folder / "scene/mesh.ply", "ply");
  write_file(folder / "scene/data/wood.png", "png");
  write_file(folder / "scene/parts/lamp.xml",
             R"(<scene version="3.0.0"><texture type="bitmap"><string name="filename" value="wood.png"/></texture></scene>)");
  write_file(folder / "scene/room.xml",
             R"(<scene version="3.0.0"><default name="kind" value="mesh"/><path value="data"/><path value=".."/>
                  <include filename="parts/lamp.xml"/>
                  <shape type="ply"><string name="filename" value="$kind.ply"/></shape>
                  <shape type="ply"><string name="filename" value="missing.ply"/></shape>
                  <emitter type="envmap"><string name="filename" value="secret.png"/></emitter></scene>)");
  const auto scene = collect_local_scene(folder / "scene/room.xml", "");
  ASSERT_TRUE(scene) << scene.error().to_string();
  Names names = names_of(*scene);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (Names{"data/wood.png", "mesh.ply", "parts/lamp.xml", "room.xml"}));
}

TEST(LocalScene, TakesWhatExistsBelowTheFolder) {
  const TemporaryFolder folder;
  write_file(folder / "secret.bin", "secret");
  write_file(folder / "scene/a.bin", "12345");
  write_file(folder / "scene/textures/b c.png", "png");
  write_file(folder / "scene/room.gltf",
             R"({"buffers": [{"uri": "a.bin"}, {"uri": "../secret.bin"}, {"uri": "missing.bin"}],
                 "images": [{"uri": "textures/b%20c.png"}]})");
  const auto scene = collect_local_scene(folder / "scene/room.gltf", "0.4,0.4,0.6");
  ASSERT_TRUE(scene) << scene.error().to_string();
  EXPECT_EQ(names_of(*scene), (Names{"room.gltf", "a.bin", "textures/b c.png"}));
  EXPECT_EQ(scene->main_file, "room.gltf");
  EXPECT_EQ(scene->environment, "0.4,0.4,0.6");
  EXPECT_EQ(scene->total_bytes(), scene->files[0].bytes + 5 + 3);
}

TEST(LocalScene, ReadsTheJsonOfAGlb) {
  const TemporaryFolder folder;
  std::string json = R"({"buffers": [{"uri": "a.bin"}]})";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string glb = "glTF";
  for (const std::uint32_t word : {2u, std::uint32_t(20 + json.size()), std::uint32_t(json.size()), 0x4E4F534Au}) {
    for (int i = 0; i < 4; ++i) glb += static_cast<char>(word >> 8 * i);
  }
  write_file(folder / "a.bin", "x");
  write_file(folder / "room.glb", glb + json);
  EXPECT_EQ(names_of(*collect_local_scene(folder / "room.glb", "")), (Names{"room.glb", "a.bin"}));
  // A length beyond the file must not be believed.
  glb[12] = glb[13] = glb[14] = '\x7f';
  write_file(folder / "broken.glb", glb + json);
  EXPECT_EQ(names_of(*collect_local_scene(folder / "broken.glb", "")), Names{"broken.glb"});
}

TEST(LocalScene, TheEnvironmentMapJoinsUnderAFreeName) {
  const TemporaryFolder folder;
  write_file(folder / "scene/sky.exr", "texture");
  write_file(folder / "scene/room.gltf", R"({"images": [{"uri": "sky.exr"}]})");
  write_file(folder / "maps/sky.exr", "map");
  const auto scene = collect_local_scene(folder / "scene/room.gltf", folder / "maps/sky.exr");
  ASSERT_TRUE(scene);
  EXPECT_EQ(names_of(*scene), (Names{"room.gltf", "sky.exr", "environment/sky.exr"}));
  EXPECT_EQ(scene->environment, "environment/sky.exr");
}

TEST(LocalScene, SaysWhatIsWrong) {
  const TemporaryFolder folder;
  write_file(folder / "room.gltf", "{}");
  EXPECT_EQ(collect_local_scene(folder / "none.gltf", "").error().code, ErrorCode::not_found);
  EXPECT_EQ(collect_local_scene(folder.path(), "").error().code, ErrorCode::not_found);
  for (const char* environment : {"1,2", "1,2,3,4", "-1,0,0", "1,nan,1", "1,2,inf", "1,2,x", "nofile.exr"}) {
    const auto scene = collect_local_scene(folder / "room.gltf", environment);
    ASSERT_FALSE(scene) << environment;
    EXPECT_EQ(scene.error().code, ErrorCode::invalid_argument);
    EXPECT_EQ(scene.error().where, "environment");
    EXPECT_NE(scene.error().message.find(environment), std::string::npos) << scene.error().message;
  }
}

TEST(EnvironmentText, IsAColourWhenAllItsPartsLookLikeNumbers) {
  for (const char* color : {"", "0,0,0", "0.4,0.4,0.6", " 1, 2e3 ,.5 ", "3.4e38,0,0"}) {
    const auto names_map = names_environment_map(color);
    ASSERT_TRUE(names_map) << color;
    EXPECT_FALSE(*names_map) << color;
  }
  for (const char* bad : {"1", "1,2", "1,2,3,4", "-1,0,0", "1,nan,2", "inf,1,1", "1e39,1,1", "1e400,1,1", "1,,2",
                          "1,2,", "+1,1,1", "1.2.3,4,5", "nan,nan,nan"}) {
    const auto names_map = names_environment_map(bad);
    ASSERT_FALSE(names_map) << bad;
    EXPECT_EQ(names_map.error().code, ErrorCode::invalid_argument);
    EXPECT_EQ(names_map.error().where, "environment");
    EXPECT_EQ(names_map.error().message,
              "'" + std::string(bad) + "' is not R,G,B: three numbers in [0, 3.4e38], separated by commas");
  }
  for (const char* map : {"sky.exr", "1,2,x", "maps/1,2,3.exr", "4k.hdr"}) {
    const auto names_map = names_environment_map(map);
    ASSERT_TRUE(names_map) << map;
    EXPECT_TRUE(*names_map) << map;
  }
}

TEST(ServerAddress, IsHostAndPort) {
  for (const char* good : {"127.0.0.1:7777", "localhost:1", "[::1]:65535", "render-7.example.org:443", "unix:/run/h"}) {
    EXPECT_TRUE(validate_server_address(good)) << good;
  }
  for (const char* bad : {"", "localhost", ":7777", "host:", "host:0", "host:65536", "host:7x", "::1:7777", "a b:1",
                          "http://host:80", "unix:"}) {
    EXPECT_FALSE(validate_server_address(bad)) << bad;
  }
  EXPECT_TRUE(is_loopback("127.0.0.1:1") && is_loopback("localhost:1") && is_loopback("[::1]:1"));
  EXPECT_TRUE(is_loopback("127.255.3.4:1") && is_loopback("[::ffff:127.0.0.1]:1") && is_loopback("unix:/run/h"));
  for (const char* other : {"10.0.0.1:1", "127.foo.example:1", "localhost.example:1", "127.0.0.1.example:1",
                            "128.0.0.1:1", "0.0.0.0:1", "[::]:1", "[::2]:1", "[::ffff:10.0.0.1]:1"}) {
    EXPECT_FALSE(is_loopback(other)) << other;
  }
}

}  // namespace
}  // namespace helio::test
