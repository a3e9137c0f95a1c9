// Nearly valid files: slips that leave the meaning beyond doubt load with a warning that names the place, and a strict
// load refuses them with all places. The same rules broken further stay refused. scenes/README.md has the table.
#include <functional>

#include "tests/unit/scene/gltf/gltf_builder.h"

namespace helio::test {
namespace {

// Two views of one buffer, a material, a camera, a spot, a clip: each rule has something to break.
GltfBuilder whole_file() {
  GltfBuilder file;
  file.add_triangle();
  file.root["materials"] = json::parse(R"([{"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]}}])");
  file.root["meshes"][0]["primitives"][0]["material"] = 0;
  file.root["cameras"] = json::parse(R"([
    {"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1, "zfar": 10}},
    {"type": "orthographic", "orthographic": {"xmag": 2, "ymag": 1, "znear": 0, "zfar": 10}}])");
  file.use("KHR_lights_punctual");
  file.root["extensions"]["KHR_lights_punctual"]["lights"] = json::parse(
      R"([{"type": "spot", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.2}}])");
  file.add_node({{"camera", 0}});
  file.add_node({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  const int input = file.add_accessor<float>({0, 1}, "SCALAR", {{"min", {0}}, {"max", {1}}});
  file.root["animations"] = {
      {{"name", "Clip"},
       {"samplers", {{{"input", input}, {"output", file.add_accessor<float>({0, 0, 0, 1, 0, 0}, "VEC3")}}}},
       {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}}}};
  return file;
}

struct Slip {
  const char* what;
  std::function<void(GltfBuilder&)> make;
  std::string place;
};

// Sets the value at a JSON pointer.
Slip at(const std::string& pointer, json value, const std::string& place = "") {
  return {"", [=](GltfBuilder& file) { file.root[json::json_pointer(pointer)] = value; },
          place.empty() ? pointer : place};
}

constexpr const char* kPbr = "/materials/0/pbrMetallicRoughness";
constexpr const char* kSpot = "/extensions/KHR_lights_punctual/lights/0/spot";

std::vector<Slip> slips() {
  const std::string pbr = kPbr, spot = kSpot;
  return {
      at(pbr + "/baseColorFactor/0", 1.00016),
      at(pbr + "/baseColorFactor/2", -1e-6),
      at(pbr + "/baseColorFactor", {1, 1, 1}),
      at(pbr + "/metallicFactor", 1.0000001),
      at(pbr + "/roughnessFactor", -0.009),
      at("/materials/0/emissiveFactor", {3, 2, 1}),
      at("/materials/0/doubleSided", 1),
      at("/materials/0/name", nullptr),
      at("/extensions/KHR_lights_punctual/lights/0/color", {1.001, 1, 1},
         "/extensions/KHR_lights_punctual/lights/0/color/0"),
      at(spot, {{"innerConeAngle", 0.39269909262657166}, {"outerConeAngle", 0.39269909262657166}},
         spot + "/outerConeAngle"),
      at(spot, {{"innerConeAngle", 0.3927}, {"outerConeAngle", 0.39269909}}, spot + "/outerConeAngle"),
      at(spot + "/outerConeAngle", 1.5708),  // pi / 2, rounded upwards
      {"a spot without cones",
       [](GltfBuilder& f) { f.root["extensions"]["KHR_lights_punctual"]["lights"][0].erase("spot"); },
       "/extensions/KHR_lights_punctual/lights/0: misses"},
      at("/skins", json::array()),
      at("/textures", json::array()),
      at("/nodes/0/children", json::array()),
      at("/nodes/0/weights", json::array()),
      at("/animations/0/channels", json::array()),
      at("/animations", json::array()),
      at("/extensionsRequired", json::array()),
      at("/nodes/0/rotation", {0, 0, 0, 1.02}),
      at("/nodes/1/matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1e-7, 0, 0, 0, 1}),
      {"matrix and parts that say the same",
       [](GltfBuilder& f) {
         f.root["nodes"][0]["matrix"] = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 1, 0, 0, 1};
         f.root["nodes"][0]["translation"] = {1, 0, 0};
         f.root["nodes"][0]["scale"] = {2, 2, 2};
       },
       "/nodes/0/matrix"},
      {"a skin beside no mesh",
       [](GltfBuilder& f) {
         f.root["skins"] = {{{"joints", {0}}}};
         f.root["nodes"][1]["skin"] = 0;
       },
       "/nodes/1/skin"},
      at("/cameras/0/perspective/znear", 0),
      at("/cameras/0/perspective/zfar", 0.05, "/cameras/0/perspective: zfar"),
      at("/cameras/0/perspective/aspectRatio", 0),
      {"a camera without znear", [](GltfBuilder& f) { f.root["cameras"][0]["perspective"].erase("znear"); },
       "/cameras/0/perspective: misses"},
      at("/cameras/1/orthographic/znear", -1),
      at("/bufferViews/0/target", 0),
      at("/bufferViews/1/byteStride", 0),
      at("/accessors/0/normalized", true),
      {"positions without bounds", [](GltfBuilder& f) { f.root["accessors"][0].erase("min"); },
       "/meshes/0/primitives/0/attributes/POSITION"},
      {"an extension that is not declared", [](GltfBuilder& f) { f.root.erase("extensionsUsed"); },
       "/extensions/KHR_lights_punctual"},
      at("/extensionsUsed", {"KHR_lights_punctual", "KHR_lights_punctual"}, "/extensionsUsed/1"),
      at("/samplers", {{{"magFilter", 9987}}}, "/samplers/0/magFilter"),
      {"keys at once",
       [](GltfBuilder& f) {
         const int input = f.add_accessor<float>({1, 1}, "SCALAR", {{"min", {1}}, {"max", {1}}});
         f.root["animations"][0]["samplers"][0]["input"] = input;
       },
       "/accessors/3"},
      {"numbers off their alignment",
       [](GltfBuilder& f) {
         const std::vector<std::uint8_t> bytes(38, 0);
         f.root["accessors"][0]["bufferView"] = f.add_view(bytes.data(), bytes.size());
         f.root["accessors"][0]["byteOffset"] = 2;
         f.add_triangle();
       },
       "/accessors/0/byteOffset"},
      {"normals of another length",
       [](GltfBuilder& f) {
         f.root["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] =
             f.add_accessor<float>({0, 0, 2, 0, 0, 1, 0, 0, 1}, "VEC3");
       },
       "/meshes/0/primitives/0/attributes/NORMAL"},
      {"attributes one after the other in one view",
       [](GltfBuilder& f) {
         const float data[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, 1};
         const int view = f.add_view(data, sizeof data);
         f.root["accessors"][0]["bufferView"] = view;
         f.root["accessors"].push_back(
             {{"bufferView", view}, {"byteOffset", 36}, {"componentType", 5126}, {"count", 3}, {"type", "VEC3"}});
         f.root["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = f.root["accessors"].size() - 1;
       },
       "/meshes/0/primitives/0/attributes/"},
  };
}

TEST(GltfSlips, LoadWithAWarningAndAreRefusedWhenStrict) {
  SceneLoadOptions strict;
  strict.strict = true;
  ASSERT_TRUE(whole_file().load(strict).ok()) << whole_file().load(strict).error().to_string();
  for (const Slip& slip : slips()) {
    GltfBuilder file = whole_file();
    slip.make(file);
    const Result<SceneDescription> scene = file.load();
    const std::string name = slip.place + " " + slip.what;
    ASSERT_TRUE(scene.ok()) << name << ": " << scene.error().to_string();
    EXPECT_GE(scene->report.slips, 1u) << name;  // an extension that is not declared: at each place
    EXPECT_TRUE(contains(scene->report.warnings, slip.place)) << name << ": " << json(scene->report.warnings).dump();
    EXPECT_TRUE(contains(file.must_fail(strict), "test.glb" + slip.place)) << name;
  }
}

TEST(GltfSlips, AreReadAsTheyAreMeant) {
  GltfBuilder file = whole_file();
  file.root["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {1.00016, -0.0001, 0.5};
  file.root["materials"][0]["emissiveFactor"] = {3, 2, 1};
  file.root["materials"][0]["doubleSided"] = 1;
  file.root["extensions"]["KHR_lights_punctual"]["lights"][0]["spot"] = {{"innerConeAngle", 0.3005},
                                                                         {"outerConeAngle", 0.3}};
  file.root["cameras"][0]["perspective"]["aspectRatio"] = 0;
  const SceneDescription scene = file.must_load();
  EXPECT_EQ(scene.materials[0].base_color, Rgb(1, 0, 0.5f));
  EXPECT_EQ(scene.materials[0].base_alpha, 1);
  EXPECT_EQ(scene.materials[0].emission, Rgb(3, 2, 1));
  EXPECT_TRUE(scene.materials[0].double_sided);
  EXPECT_EQ(scene.lights[0].inner_cone_angle, 0.3f);
  EXPECT_EQ(scene.lights[0].outer_cone_angle, 0.3f);
  EXPECT_FALSE(scene.cameras[0].keeps_aspect);
}

TEST(GltfSlips, StrictLoadsNameEveryPlace) {
  GltfBuilder file = whole_file();
  file.root["materials"][0]["pbrMetallicRoughness"]["metallicFactor"] = 1.001;  // seen while the JSON is read
  file.root["skins"] = json::array();
  file.root["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] =
      file.add_accessor<float>({0, 0, 0, 0, 0, 1, 0, 0, 1}, "VEC3");  // seen when meshes are built
  SceneLoadOptions strict;
  strict.strict = true;
  const std::string error = file.must_fail(strict);
  for (const char* place : {"/materials/0/pbrMetallicRoughness/metallicFactor: is 1.001, allowed: 0 to 1",
                            "/skins: is empty", "/meshes/0/primitives/0/attributes/NORMAL: 1 normals of length zero"})
    EXPECT_TRUE(contains(error, place)) << error;
}

// Farther off, or with two meanings, or beyond the bytes.
TEST(GltfSlips, DoubtStaysRefused) {
  const std::string pbr = kPbr, spot = kSpot;
  const std::vector<Slip> doubtful = {
      at(pbr + "/baseColorFactor/0", 1.02),
      at(pbr + "/metallicFactor", "1"),
      at(pbr + "/baseColorFactor", {1, 1}),
      at("/materials/0/emissiveFactor", {3, -2, 1}, "/materials/0/emissiveFactor/1"),
      at("/materials/0/doubleSided", 2),
      at("/materials/0/alphaMode", "GLASS"),
      at(spot, {{"innerConeAngle", 0.5}, {"outerConeAngle", 0.4}}, spot + "/outerConeAngle"),
      at(spot, {{"innerConeAngle", 0.9}}, spot + "/innerConeAngle"),
      at(spot + "/outerConeAngle", 2.0),
      at("/extensions/KHR_lights_punctual/lights/0/range", 0),
      at("/nodes/0/mesh", -1),
      at("/nodes/0/rotation", {0, 0, 0, 2}),
      at("/nodes/0/rotation", {0, 0, 0, 0}),
      at("/nodes/0/matrix", {1, 0, 0, 0.1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}),
      at("/skins", {{{"joints", json::array()}}}, "/skins/0/joints"),
      at("/cameras/0/perspective/yfov", nullptr, "/cameras/0/perspective"),
      at("/cameras/1/orthographic/xmag", 0),
      at("/accessors/0/count", 4, "/accessors/0"),
      at("/bufferViews/0/byteLength", 4000, "/bufferViews/0"),
      at("/bufferViews/0/byteStride", 2),
      at("/accessors/0/componentType", 5130),
      {"keys that go back",
       [](GltfBuilder& f) {
         const int input = f.add_accessor<float>({1, 0.5f}, "SCALAR", {{"min", {0.5}}, {"max", {1}}});
         f.root["animations"][0]["samplers"][0]["input"] = input;
       },
       "/accessors/3"},
      {"attributes that interlock without a byteStride",
       [](GltfBuilder& f) {
         const float data[18] = {};
         const int view = f.add_view(data, sizeof data);
         f.root["accessors"][0]["bufferView"] = view;
         f.root["accessors"].push_back(
             {{"bufferView", view}, {"byteOffset", 12}, {"componentType", 5126}, {"count", 3}, {"type", "VEC3"}});
         f.root["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = f.root["accessors"].size() - 1;
       },
       "/meshes/0/primitives/0/attributes/"},
      {"matrix and parts that say different things",
       [](GltfBuilder& f) {
         f.root["nodes"][0]["matrix"] = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 1, 0, 0, 1};
         f.root["nodes"][0]["scale"] = {2, 2, 2};
       },
       "/nodes/0/matrix"},
  };
  for (const Slip& slip : doubtful) {
    GltfBuilder file = whole_file();
    slip.make(file);
    const std::string error = file.must_fail();
    EXPECT_TRUE(contains(error, slip.place)) << slip.place << " " << slip.what << ": " << error;
  }
}

// An image is what its bytes say, whatever it is declared as.
TEST(GltfSlips, ImagesAreWhatTheirBytesSay) {
  const std::string png =  // one white pixel
      "data:image/jpg;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGP6DwABBQECz6AuzQAAAABJRU5ErkJggg==";
  GltfBuilder file;
  file.add_mesh({{"attributes",
                  {{"POSITION", file.add_positions({0, 0, 0, 1, 0, 0, 0, 1, 0})},
                   {"TEXCOORD_0", file.add_accessor<float>({0, 0, 1, 0, 0, 1}, "VEC2")}}},
                 {"material", 0}});
  file.root["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  file.root["textures"] = {{{"source", 0}}};
  for (const char* declared : {"image/jpeg", "image/jpg", "image/PNG"}) {
    file.root["images"] = {{{"uri", png}, {"mimeType", declared}}};
    const SceneDescription scene = file.must_load();
    ASSERT_EQ(scene.images.size(), 1u) << declared;
    EXPECT_TRUE(contains(scene.report.warnings, "/images/0")) << declared;
  }
}

TEST(GltfSlips, ByteOrderMarksAreSkipped) {
  const std::string text = "\xEF\xBB\xBF" R"({"asset": {"version": "2.0"}})";
  const auto load = [&](bool strict) {
    SceneLoadOptions options;
    options.strict = strict;
    return load_scene(*make_memory_source({{"a.gltf", {text.begin(), text.end()}}}), "a.gltf", options);
  };
  ASSERT_TRUE(load(false).ok()) << load(false).error().to_string();
  EXPECT_TRUE(contains(load(false)->report.warnings, "byte order mark"));
  EXPECT_TRUE(contains(load(true).error().to_string(), "byte order mark"));
}

TEST(GltfSlips, LinesThatAreLeftOutAreCounted) {
  GltfBuilder file = whole_file();
  for (int i = 0; i < 100; ++i) file.root["nodes"].push_back({{"children", json::array()}});
  const SceneDescription scene = file.must_load();
  EXPECT_EQ(scene.report.warnings.size(), 64u);
  EXPECT_EQ(scene.report.more_warnings, 36u);
  EXPECT_EQ(scene.report.slips, 100u);
  SceneLoadOptions strict;
  strict.strict = true;
  // As many as a status of gRPC's carries, and the number of the others.
  const std::string refused = file.must_fail(strict);
  std::size_t told = 0;
  for (std::size_t at = 0; (at = refused.find("/nodes/", at)) != std::string::npos; ++at) ++told;
  EXPECT_GE(told, 20u) << refused;
  EXPECT_LE(refused.size(), 1800u);
  EXPECT_TRUE(refused.ends_with("; and " + std::to_string(100 - told) + " more")) << refused;
}

}  // namespace
}  // namespace helio::test
