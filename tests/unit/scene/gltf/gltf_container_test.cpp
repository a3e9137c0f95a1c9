// The outer layers: GLB chunks, JSON, version, extensions, URIs, other files.
#include "renderer/scene/gltf/document/container.h"

#include "renderer/scene/gltf/document/uri.h"
#include "tests/unit/scene/gltf/gltf_builder.h"

namespace helio::test {
namespace {

std::vector<std::uint8_t> bytes_of(const std::string& text) {
  return {text.begin(), text.end()};
}

Result<SceneDescription> load_text(const std::string& text, std::vector<NamedFile> others = {},
                                   const std::string& name = "test.gltf") {
  others.push_back({name, bytes_of(text)});
  return load_scene(*make_memory_source(std::move(others)), name, {});
}

TEST(GltfContainer, EveryTruncationOfAGlbIsRefused) {
  GltfBuilder file;
  file.add_triangle();
  const std::vector<std::uint8_t> glb = file.glb();
  ASSERT_TRUE(gltf::open_container(glb, "a.glb", true).ok());
  for (std::size_t size = 0; size < glb.size(); ++size) {
    const Result<gltf::Container> cut = gltf::open_container(std::span(glb).first(size), "a.glb", true);
    ASSERT_FALSE(cut.ok()) << size;
    EXPECT_TRUE(cut.error().where.starts_with("a.glb@")) << cut.error().where;
  }
}

TEST(GltfContainer, ContentDecidesTheFormat) {
  GltfBuilder file;
  file.add_triangle();
  // A GLB that calls itself .gltf, and JSON that has no extension at all.
  EXPECT_TRUE(load_scene(*make_memory_source({{"a.gltf", file.glb()}}), "a.gltf", {}).ok());
  EXPECT_TRUE(load_text(R"({"asset": {"version": "2.0"}})", {}, "scene").ok());
  const auto unknown = load_text("o cube\nv 0 0 0\n", {}, "cube.obj");
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().where, "cube.obj@0");
}

TEST(GltfContainer, BrokenJsonIsRefusedWithItsByte) {
  // The text ends at byte 10, where a value was expected.
  const auto broken = load_text(R"({"asset": )");
  ASSERT_FALSE(broken.ok());
  EXPECT_EQ(broken.error().where, "test.gltf@10");
  const auto huge = load_text(R"({"asset": {"version": "2.0"}, "x": 1e999})");
  ASSERT_FALSE(huge.ok());
  EXPECT_TRUE(contains(huge.error().message, "1e999")) << huge.error().message;
  const auto deep = load_text(R"({"asset": )" + std::string(100000, '['));
  ASSERT_FALSE(deep.ok());
  EXPECT_TRUE(contains(deep.error().message, "levels")) << deep.error().message;
}

TEST(GltfContainer, JsonThatWouldBlowUpIsRefusedBeforeParsing) {
  // "[]," is 3 bytes of text and some 50 of tree; 3 MiB of it is over a limit of 64 MiB.
  std::string text = R"({"asset": {"version": "2.0"}, "x": [)";
  for (int i = 0; i < 1 << 20; ++i) text += "[],";
  text += "[]]}";
  SceneLoadOptions options;
  options.max_memory_bytes = 64 << 20;
  const auto scene = load_scene(*make_memory_source({{"a.gltf", bytes_of(text)}}), "a.gltf", options);
  ASSERT_FALSE(scene.ok());
  EXPECT_EQ(scene.error().code, ErrorCode::resource_exhausted);
  EXPECT_TRUE(contains(scene.error().message, "max_memory_bytes")) << scene.error().message;
}

TEST(GltfContainer, EveryProblemIsReported) {
  const auto scene = load_text(R"({"asset": {"version": "2.0"},
    "cameras": [{"type": "perspective", "perspective": {"yfov": -1, "znear": "near"}}],
    "nodes": [{"mesh": 3}, {"camera": 0, "children": [1]}]})");
  ASSERT_FALSE(scene.ok());
  const std::string text = scene.error().to_string();
  for (const char* place : {"/cameras/0/perspective/yfov: is -1, allowed: above 0", "/perspective/znear: is \"near\"",
                            "/nodes/0/mesh: is 3, but there are 0 meshes", "/nodes/1: is its own ancestor"})
    EXPECT_TRUE(contains(text, place)) << place << "\n" << text;
}

TEST(GltfContainer, UnknownExtensions) {
  GltfBuilder file;
  file.add_triangle();
  file.use("EXT_we_do_not_know");
  EXPECT_TRUE(contains(file.must_load().report.warnings, "optional extension EXT_we_do_not_know is ignored"));
  for (const char* name : {"EXT_we_do_not_know", "KHR_texture_basisu", "EXT_texture_webp"}) {
    GltfBuilder required;
    required.add_triangle();
    required.use(name, true);
    const auto scene = required.load();
    ASSERT_FALSE(scene.ok()) << name;
    EXPECT_EQ(scene.error().code, ErrorCode::unimplemented);
    EXPECT_EQ(scene.error().where, "test.glb/extensionsRequired/0");
    EXPECT_TRUE(contains(scene.error().message, name));
  }
}

TEST(GltfContainer, UnknownKeysAreReported) {
  GltfBuilder file;
  file.add_triangle();
  file.root["nodes"][0]["colour"] = "red";
  file.root["nodes"][0]["extras"] = {{"colour", "red"}};  // extras belong to whoever wrote them
  const LoadReport report = file.must_load().report;
  EXPECT_EQ(report.unread, std::vector<std::string>{"/nodes/0/colour"});
}

TEST(GltfContainer, BuffersFromUrisAndFiles) {
  // One triangle: three positions of three floats are 36 bytes. Data URI with base64, with escapes, and a file.
  const std::string json_head = R"({"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                   "min": [0, 0, 0], "max": [1, 1, 0]}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": ")";
  const float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  std::vector<std::uint8_t> bin(36);
  std::memcpy(bin.data(), positions, 36);
  std::string escaped = "data:application/octet-stream,";
  for (const std::uint8_t byte : bin) {
    char text[4];
    std::snprintf(text, sizeof text, "%%%02X", byte);
    escaped += text;
  }
  // 36 zero bytes are 48 letters A; 1.0f is 00 00 80 3f, at bytes 12 and 28: letters 16.. and 37..
  const std::string base64 = "data:application/gltf-buffer;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
  for (const std::string& uri :
       {escaped, base64, std::string("sub/some%20data.bin"), std::string("./sub/../sub/some%20data.bin")}) {
    const auto scene = load_text(json_head + uri + R"("}]})", {{"sub/some data.bin", bin}});
    ASSERT_TRUE(scene.ok()) << uri << ": " << scene.error().to_string();
    EXPECT_EQ(scene->objects[0].meshes[0].positions, (std::vector<V3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})) << uri;
  }
  struct Bad {
    const char* uri;
    ErrorCode code;
  };
  for (const auto& [uri, code] :
       {Bad{"../outside.bin", ErrorCode::permission_denied}, Bad{"sub/../../outside.bin", ErrorCode::permission_denied},
        Bad{"/etc/passwd", ErrorCode::permission_denied}, Bad{"%2fetc/passwd", ErrorCode::permission_denied},
        Bad{"%2e%2e/outside.bin", ErrorCode::permission_denied},
        Bad{"http://example.com/a.bin", ErrorCode::permission_denied}, Bad{"C:/a.bin", ErrorCode::permission_denied},
        Bad{"missing.bin", ErrorCode::not_found}, Bad{"a%00.bin", ErrorCode::invalid_argument},
        Bad{"a%zz.bin", ErrorCode::invalid_argument},
        Bad{"data:application/octet-stream;base64,A", ErrorCode::invalid_argument},
        Bad{"data:application/octet-stream;base64,AA==", ErrorCode::invalid_argument}}) {
    const auto scene = load_text(json_head + uri + R"("}]})", {{"sub/some data.bin", bin}});
    ASSERT_FALSE(scene.ok()) << uri;
    EXPECT_EQ(scene.error().code, code) << scene.error().to_string();
    EXPECT_TRUE(scene.error().where.starts_with("test.gltf/buffers/0")) << scene.error().where;
  }
}

TEST(GltfContainer, ReferencedFiles) {
  const std::string text = R"({"asset": {"version": "2.0"},
    "buffers": [{"byteLength": 1, "uri": "a%20b.bin"}, {"byteLength": 1, "uri": "data:application/octet-stream;base64,AA=="},
                {"byteLength": 1}],
    "images": [{"uri": "tex/c.png"}, {"uri": "./tex/c.png"}, {"uri": "https://example.com/d.png"}],
    "scenes": [{"extras": {"heliograph": {"environment": {"image": "sky.exr"}}}}]})";
  const Result<std::vector<std::string>> files = referenced_files(bytes_of(text), "x.gltf");
  ASSERT_TRUE(files.ok()) << files.error().to_string();
  EXPECT_EQ(*files, (std::vector<std::string>{"a b.bin", "tex/c.png", "sky.exr"}));
  EXPECT_FALSE(referenced_files(bytes_of("{"), "x.gltf").ok());
}

TEST(GltfUri, ResolvesAgainstTheScenesFolder) {
  EXPECT_EQ(*gltf::resolve_uri("a/b/c.gltf", "d.bin"), "a/b/d.bin");
  EXPECT_EQ(*gltf::resolve_uri("a/b/c.gltf", "../d.bin"), "a/d.bin");
  EXPECT_EQ(*gltf::resolve_uri("c.gltf", "../d.bin"), "../d.bin");  // for the source to refuse
  EXPECT_FALSE(gltf::resolve_uri("c.gltf", "").ok());
  EXPECT_TRUE(gltf::has_scheme("file:///x"));
  EXPECT_FALSE(gltf::has_scheme("dir/a:b"));
}

}  // namespace
}  // namespace helio::test
