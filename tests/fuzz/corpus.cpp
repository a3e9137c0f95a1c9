// Writes the files that the fuzzers start from: DIR/gltf, DIR/messages, DIR/mitsuba, DIR/tile and DIR/web, each a few
// hundred bytes. tests/fuzz/corpus holds what it wrote; what fuzzing found since lies beside it.
//
// usage: helio_fuzz_corpus DIR
#include <zlib.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "heliograph/v1/frame_stream.pb.h"
#include "heliograph/v1/job.pb.h"
#include "heliograph/v1/render_service.pb.h"
#include "heliograph/v1/types.pb.h"
#include "heliograph/v1/web.pb.h"
#include "renderer/codec/tile_codec.h"

namespace {

namespace pb = heliograph::v1;
using nlohmann::json;

void write(const std::filesystem::path& path, const std::string& bytes) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), std::streamsize(bytes.size()));
  if (!file.flush()) {
    std::fprintf(stderr, "helio_fuzz_corpus: cannot write %s\n", path.c_str());
    std::exit(1);
  }
}

// ---- glTF ----------------------------------------------------------------------------------------------------------

json triangle() {
  json root;
  root["asset"]["version"] = "2.0";
  root["buffers"] = {{{"byteLength", 36}}};
  root["bufferViews"] = {{{"buffer", 0}, {"byteLength", 36}}};
  root["accessors"] = {{{"bufferView", 0},
                        {"componentType", 5126},
                        {"count", 3},
                        {"type", "VEC3"},
                        {"min", {0, 0, 0}},
                        {"max", {1, 1, 0}}}};
  root["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", 0}}}}}}}};
  root["nodes"] = {{{"mesh", 0}}};
  root["scenes"] = {{{"nodes", {0}}}};
  return root;
}

// (0 0 0) (1 0 0) (0 1 0), little endian.
std::string corner_bytes() {
  std::string bytes(36, '\0');
  bytes.replace(12, 4, std::string("\0\0\x80\x3f", 4));
  bytes.replace(28, 4, std::string("\0\0\x80\x3f", 4));
  return bytes;
}

std::string u32(std::size_t value) {
  std::string bytes;
  for (int i = 0; i < 4; ++i) bytes += char(value >> (8 * i));
  return bytes;
}

// One triangle, stored rather than compressed, so that mutations of its numbers reach the parser.
std::string serialized_mesh() {
  const std::string plain = u32(0x1000) + std::string("m\0", 2) + u32(3) + u32(0) + u32(1) + u32(0) + corner_bytes() +
                            u32(0) + u32(1) + u32(2);
  std::string stored(compressBound(uLong(plain.size())), '\0');
  uLongf size = uLongf(stored.size());
  compress2(reinterpret_cast<Bytef*>(stored.data()), &size, reinterpret_cast<const Bytef*>(plain.data()),
            uLong(plain.size()), Z_NO_COMPRESSION);
  stored.resize(size);
  return u32(0x0004041C) + stored + u32(0) + u32(0) + u32(1);
}

std::string glb(const json& root) {
  std::string text = root.dump(), bin = corner_bytes();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  return "glTF" + u32(2) + u32(28 + text.size() + bin.size()) + u32(text.size()) + "JSON" + text + u32(bin.size()) +
         std::string("BIN\0", 4) + bin;
}

void write_gltf(const std::filesystem::path& folder) {
  json root = triangle();
  write(folder / "triangle.glb", glb(root));
  // The same with its bytes in the JSON: three corners in base64.
  root["buffers"][0]["uri"] = "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
  write(folder / "triangle.gltf", root.dump());
  root["materials"] = json::parse(R"([{"pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0, 0.5],
      "roughnessFactor": 0}, "alphaMode": "MASK", "emissiveFactor": [1, 1, 1],
    "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_ior": {"ior": 1.3},
      "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 2}}}])");
  root["meshes"][0]["primitives"][0]["material"] = 0;
  root["extensionsUsed"] = {"KHR_materials_transmission", "KHR_materials_ior", "KHR_materials_volume",
                            "KHR_lights_punctual"};
  root["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "spot"}, {"spot", json::object()}}};
  root["cameras"] = json::parse(R"([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}])");
  root["nodes"][0]["children"] = {1, 2};
  root["nodes"].push_back(
      {{"translation", {0, 0, 3}}, {"camera", 0}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  root["nodes"].push_back({{"scale", {100, -1, 0.5}}, {"mesh", 0}});
  write(folder / "material_light_camera.gltf", root.dump());
  root = triangle();
  root["accessors"].push_back(
      {{"bufferView", 0}, {"componentType", 5126}, {"count", 2}, {"type", "SCALAR"}, {"min", {0}}, {"max", {0}}});
  root["accessors"].push_back({{"bufferView", 0}, {"componentType", 5126}, {"count", 2}, {"type", "VEC3"}});
  root["accessors"][0]["sparse"] = {
      {"count", 1}, {"indices", {{"bufferView", 0}, {"componentType", 5121}}}, {"values", {{"bufferView", 0}}}};
  root["animations"] = {{{"samplers", {{{"input", 1}, {"output", 2}}}},
                         {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}}}};
  root["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", 0}}};
  root["meshes"][0]["weights"] = {0.5};
  write(folder / "sparse_animation_morph.glb", glb(root));
}

// ---- Mitsuba -------------------------------------------------------------------------------------------------------

void write_mitsuba(const std::filesystem::path& folder) {
  const auto scene = [](const std::string& body, const std::string& version = "3.0.0") {
    return "<scene version=\"" + version + "\">" + body + "</scene>";
  };
  write(folder / "plugins.xml", scene(R"(<default name="n" value="4"/>
<sensor type="thinlens"><float name="fov" value="40"/><float name="aperture_radius" value="0.1"/>
<transform name="to_world"><lookat origin="0,1,4" target="0,0,0" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="$n"/><integer name="height" value="3"/><rfilter type="tent"/></film></sensor>
<bsdf type="roughconductor" id="m"><string name="material" value="Au"/><float name="alpha" value="0.2"/></bsdf>
<bsdf type="dielectric" id="g"><float name="int_ior" value="1.5"/></bsdf>
<shape type="sphere"><point name="center" x="1" y="0" z="0"/><float name="radius" value="0.5"/><ref id="m"/></shape>
<shape type="cube"><transform name="to_world"><rotate y="1" angle="30"/><scale value="0.5"/></transform><ref id="g"/></shape>
<shape type="shapegroup" id="group"><shape type="rectangle"><bsdf type="twosided"><bsdf type="diffuse">
<texture type="checkerboard" name="reflectance"><rgb name="color0" value="0.1 0.2 0.3"/></texture></bsdf></bsdf></shape></shape>
<shape type="instance"><ref id="group"/><transform name="to_world"><translate x="2"/></transform></shape>
<emitter type="point"><point name="position" x="0" y="3" z="0"/><spectrum name="intensity" value="400:1, 700:2"/></emitter>
<emitter type="constant"><rgb name="radiance" value="1"/></emitter>)"));
  write(
      folder / "materials.xml",
      scene(
          "<bsdf type='twosided' id='b'><bsdf type='blendbsdf'><float name='weight' value='0.3'/><bsdf type='plastic'/>"
          "<bsdf type='roughconductor'><string name='material' value='Au'/><float name='alpha_u' value='0.1'/></bsdf>"
          "</bsdf></bsdf><shape type='rectangle'><ref id='b'/><emitter type='area'/></shape>"
          "<shape type='rectangle'><bsdf type='mask'><bsdf type='principled'><float name='spec_trans' value='0.5'/>"
          "</bsdf></bsdf></shape><shape type='cube'><bsdf type='bumpmap'><texture type='checkerboard'/>"
          "<bsdf type='roughdielectric'/></bsdf></shape><shape type='disk'><bsdf type='null'/></shape>"));
  write(folder / "projector.xml",
        scene("<emitter type='projector'><texture name='irradiance' type='checkerboard'/><float name='fov' value='40'/>"
              "<string name='fov_axis' value='y'/><transform name='to_world'><matrix value='1 0 0 0 0 2 0 0 0.5 0 1 3 "
              "0 0 0 1'/></transform></emitter><emitter type='projector'><rgb name='irradiance' value='1 2 3'/>"
              "<float name='scale' value='0.1'/></emitter><shape type='rectangle'/>"));
  write(
      folder / "group.xml",
      scene("<shape type='shapegroup' id='g'><shape type='cube'/></shape><shape type='instance'><ref id='g'/></shape>"
            "<bsdf type='dielectric' id='d'><float name='intIOR' value='1.5'/></bsdf><shape type='sphere'><ref id='d'/>"
            "</shape>",
            "0.6.0"));
  const auto mesh = [&](const char* type, const std::string& bytes) {
    const std::string name = std::string("mesh.") + type;
    write(folder / name, scene("<shape type=\"" + std::string(type) + "\"><string name=\"filename\" value=\"" + name +
                               "\"/><bsdf type=\"diffuse\"/></shape>") +
                             std::string(1, '\0') + bytes);
  };
  mesh("obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf -1//1 -2//1 -3//1\n");
  const std::string head =
      " 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  mesh("ply", "ply\nformat ascii" + head + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  write(folder / "binary.ply", scene("<shape type=\"ply\"><string name=\"filename\" value=\"mesh.ply\"/></shape>") +
                                   std::string(1, '\0') + "ply\nformat binary_little_endian" + head + corner_bytes() +
                                   "\x03" + u32(0) + u32(1) + u32(2));
  mesh("serialized", serialized_mesh());
}

// ---- messages ------------------------------------------------------------------------------------------------------

pb::View view() {
  pb::View v;
  v.set_id(7);
  pb::CameraView& camera = *v.mutable_camera();
  camera.mutable_position()->set_z(3);
  camera.mutable_look_at()->mutable_target()->set_x(1);
  camera.mutable_look_at()->mutable_up()->set_y(1);
  camera.set_vertical_fov(0.7);
  return v;
}

pb::RenderSettings settings() {
  pb::RenderSettings s;
  s.set_width(640);
  s.set_height(360);
  s.set_seed(3);
  s.set_mode(pb::MODE_COMBINED);
  s.mutable_adaptive()->set_min_samples(8);
  s.set_variant(pb::VARIANT_PAPER);
  s.mutable_reprojection()->set_stored_hits(1);
  s.mutable_reprojection()->set_max_error(0.02);
  return s;
}

void write_messages(const std::filesystem::path& folder) {
  // The first byte is the choice that fuzz_messages.cpp makes.
  const auto message = [&](char choice, const char* name, const google::protobuf::Message& m) {
    write(folder / name, std::string(1, choice) + m.SerializeAsString());
  };
  message(0, "view", view());
  message(1, "settings", settings());
  pb::Budget budget;
  budget.set_time_s(2);
  budget.set_error(0.1);
  message(2, "budget", budget);
  pb::TileFormat format;
  format.set_history(true);
  format.set_density(true);
  message(3, "format", format);
  pb::StreamRequest request;
  *request.mutable_view() = view();
  message(4, "stream", request);
  pb::RunJobRequest job;
  job.set_scene_id("scene");
  *job.mutable_settings() = settings();
  *job.mutable_budget() = budget;
  message(5, "job", job);
  pb::EditSceneRequest edit;
  edit.set_scene_id("scene");
  pb::ObjectEdit& object = *edit.add_edits()->mutable_object();
  object.set_name("o");
  for (int i = 0; i < 12; ++i) object.add_transform(i % 5 == 0);
  object.set_relative(true);
  pb::MaterialEdit& material = *edit.add_edits()->mutable_material();
  material.set_index(0);
  material.mutable_base_color()->set_x(0.5);
  material.mutable_emission()->set_y(2);
  material.set_roughness(0.25);
  pb::LightEdit& light = *edit.add_edits()->mutable_light();
  light.set_name("l");
  light.set_scale(3);
  edit.add_edits()->mutable_environment()->mutable_radiance()->set_z(1);
  message(6, "edit", edit);
}

// ---- tiles ---------------------------------------------------------------------------------------------------------

void write_tiles(const std::filesystem::path& folder) {
  using namespace helio;
  constexpr int kWidth = 9, kHeight = 5;
  std::vector<float> values(kWidth * kHeight);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = float(i * i % 17) * 0.25f;
  const TileChannel channels[] = {{"R", values.data()}, {"variance.R", values.data(), true, true}};
  const TileHeader header{{16, 8, 16 + kWidth, 8 + kHeight}, 64, 32};
  const std::pair<const char*, TileCompression> kinds[] = {
      {"none.exr", TileCompression::none}, {"rle.exr", TileCompression::rle}, {"zips.exr", TileCompression::zips},
      {"zip.exr", TileCompression::zip},   {"piz.exr", TileCompression::piz}, {"dwaa.exr", TileCompression::dwaa}};
  for (const auto& [name, compression] : kinds) {
    const auto bytes = encode_tile(header, channels, {TilePixelType::half, compression});
    if (!bytes) {
      std::fprintf(stderr, "helio_fuzz_corpus: %s\n", bytes.error().to_string().c_str());
      std::exit(1);
    }
    write(folder / name, {bytes->begin(), bytes->end()});
  }
}

// ---- the page's server ---------------------------------------------------------------------------------------------

// The first byte: fuzz_web.cpp.
void write_web(const std::filesystem::path& folder) {
  write(folder / "get", std::string(1, '\0') +
                            "GET /index.html?a HTTP/1.1\r\nHost: [::1]:80\r\nAccept-Encoding: gzip\r\n\r\n"
                            "HEAD /healthz HTTP/1.0\r\n\r\n");
  write(folder / "upgrade",
        std::string(1, '\0') +
            "GET /ws HTTP/1.1\r\nHost: localhost\r\nOrigin: http://localhost\r\n"
            "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: heliograph.v1\r\n\r\n");
  // A ping, a message in two pieces, a close; masks of zeros.
  write(folder / "frames",
        std::string("\1\x89\x81\0\0\0\0p\x02\x81\0\0\0\0a\x80\x81\0\0\0\0b\x88\x82\0\0\0\0\x03\xe8", 30));
  std::string calls = "\2";
  const auto add = [&calls](const pb::WebRequest& request) {
    const std::string bytes = request.SerializeAsString();
    calls += char(bytes.size()) + bytes;
  };
  pb::WebRequest request;
  request.set_id(1);
  request.mutable_get_server_info();
  add(request);
  request.set_id(2);
  request.mutable_load_scene()->mutable_begin()->set_main_file("a.gltf");
  request.mutable_load_scene()->mutable_begin()->set_total_bytes(2);
  add(request);
  request.mutable_load_scene()->mutable_begin_file()->set_name("a.gltf");
  add(request);
  request.mutable_load_scene()->set_data("{}");
  add(request);
  request.mutable_end();
  add(request);
  request.set_id(3);
  request.mutable_stream_frames()->mutable_open()->set_session_id("s");
  add(request);
  request.mutable_cancel();
  add(request);
  write(folder / "calls", calls);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: helio_fuzz_corpus DIR\n");
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  write_gltf(folder / "gltf");
  write_messages(folder / "messages");
  write_mitsuba(folder / "mitsuba");
  write_tiles(folder / "tile");
  write_web(folder / "web");
  return 0;
}
