// No path, link or name leads out of the scene roots and the output roots.
#include <fcntl.h>
#include <sys/stat.h>

#include <atomic>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <thread>

#include "jobs/kept_jobs_fixture.h"
#include "renderer/base/open_beneath.h"
#include "renderer/codec/sha256.h"
#include "renderer/scene/description/file_source.h"
#include "server/jobs/output_roots.h"
#include "server/scenes/scene_roots.h"

namespace helio::test {
namespace {

using grpc::StatusCode;
namespace fs = std::filesystem;

const std::string kSecret = "the secret";

class Paths : public ServiceTest {
 protected:
  void SetUp() override {
    write_file(in("root/quad.gltf"), quad_gltf());
    write_file(in("root/sub/quad.gltf"), quad_gltf());
    write_file(in("outside/secret.gltf"), quad_gltf(3));
    write_file(in("outside/secret.bin"), std::string(60, 's'));
    write_file(in("outside/secret.xml"), "<shape type=\"rectangle\"/>");
    fs::create_symlink(in("outside/secret.gltf"), in("root/link.gltf"));
    fs::create_symlink(in("outside/secret.bin"), in("root/link.bin"));
    fs::create_directory_symlink(in("outside"), in("root/linked"));
    fs::create_directory_symlink("../outside", in("root/relative"));
    fs::create_symlink(in("root/sub/quad.gltf"), in("root/inside.gltf"));
  }
  std::string in(const std::string& name) const { return folder_ / name; }
  void start_roots() {
    start([&](ServerConfig& config) { config.scene_roots = {in("root")}; });
  }
  grpc::Status load_path(const std::string& path, const std::string& environment = "0,0,0") {
    pb::LoadSceneRequest request;
    request.mutable_begin()->set_path(path);
    request.mutable_begin()->set_environment(environment);
    pb::LoadSceneResponse response;
    return load({request}, &response);
  }
  int scenes() {
    pb::ListScenesResponse list;
    EXPECT_TRUE(call(&pb::RenderService::Stub::ListScenes, pb::ListScenesRequest(), &list).ok());
    return list.scenes_size();
  }
  // The square, whose buffer is this file.
  void write_naming(const std::string& file, const std::string& uri) {
    auto gltf = nlohmann::json::parse(quad_gltf());
    gltf["buffers"][0]["uri"] = uri;
    write_file(in("root/" + file), gltf.dump());
  }

  TemporaryFolder folder_;
};

TEST_F(Paths, OfScenesStayBelowTheirRoot) {
  start_roots();
  for (const std::string& path :
       {std::string("../outside/secret.gltf"), std::string("sub/../../outside/secret.gltf"), in("outside/secret.gltf"),
        std::string("/etc/passwd"), std::string("link.gltf"), std::string("linked/secret.gltf"),
        std::string("relative/secret.gltf"), std::string("../outside/nothing.gltf"), std::string("..")}) {
    expect_status(load_path(path), StatusCode::PERMISSION_DENIED, {"begin.path", "outside the scene roots"});
  }
  for (const std::string& path : {std::string("quad.gltf\0.png", 14), std::string("quad\n.gltf"),
                                  std::string("\x1b[2J.gltf"), std::string("quad.gltf\x7f"), std::string()}) {
    EXPECT_EQ(load_path(path).error_code(), StatusCode::INVALID_ARGUMENT) << path;
  }
  EXPECT_EQ(load_path("quad.gltf", "../outside/map.exr").error_code(), StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(load_path("quad.gltf", "linked/map.exr").error_code(), StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(scenes(), 0);
  EXPECT_TRUE(load_path("inside.gltf").ok()) << "a link that stays inside";
  EXPECT_TRUE(load_path(in("root/quad.gltf")).ok());
}

TEST_F(Paths, APipeOrAFolderIsNoScene) {
  start_roots();
  ASSERT_EQ(mkfifo(in("root/pipe.gltf").c_str(), 0600), 0);
  EXPECT_EQ(load_path("pipe.gltf").error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(load_path("sub").error_code(), StatusCode::NOT_FOUND);
  const auto source = make_directory_source(in("root"));
  EXPECT_FALSE(source->read("pipe.gltf", 1 << 20).ok());
}

TEST_F(Paths, FilesThatASceneNamesStayBelowItsRoot) {
  start_roots();
  write_file(in("root/own.bin"), std::string(60, '\0'));
  for (const std::string& uri :
       {std::string("../outside/secret.bin"), in("outside/secret.bin"), "file://" + in("outside/secret.bin"),
        std::string("%2e%2e/outside/secret.bin"), std::string("..%2Foutside%2Fsecret.bin"),
        std::string("sub/../../outside/secret.bin"), std::string("link.bin"), std::string("linked/secret.bin"),
        std::string("..\\outside\\secret.bin")}) {
    write_naming("names.gltf", uri);
    const grpc::Status status = load_path("names.gltf");
    EXPECT_FALSE(status.ok()) << uri;
    EXPECT_EQ(status.error_message().find("sss"), std::string::npos) << "tells what is in the file";
  }
  const auto mitsuba = [&](const std::string& child) {
    write_file(in("root/names.xml"), "<scene version=\"3.0.0\">" + child + "</scene>");
    return load_path("names.xml");
  };
  for (const char* file : {"../outside/secret.xml", "linked/secret.xml"}) {
    EXPECT_FALSE(mitsuba("<include filename=\"" + std::string(file) + "\"/>").ok()) << file;
    EXPECT_FALSE(
        mitsuba("<shape type=\"obj\"><string name=\"filename\" value=\"" + std::string(file) + "\"/></shape>").ok());
  }
  EXPECT_FALSE(mitsuba("<include filename=\"" + in("outside/secret.xml") + "\"/>").ok());
  EXPECT_EQ(scenes(), 0);
  // An entity of XML is no way out either: what it names is not read.
  write_file(in("root/names.xml"), "<!DOCTYPE scene [<!ENTITY x SYSTEM \"file://" + in("outside/secret.xml") +
                                       "\">]><scene version=\"3.0.0\">&x;</scene>");
  pb::LoadSceneRequest request;
  request.mutable_begin()->set_path("names.xml");
  pb::LoadSceneResponse loaded;
  if (load({request}, &loaded).ok()) {
    EXPECT_EQ(loaded.scene().instances(), 0u);
  }
  write_naming("names.gltf", "own.bin");
  const grpc::Status own = load_path("names.gltf");
  EXPECT_NE(own.error_code(), StatusCode::PERMISSION_DENIED) << own.error_message();
}

TEST_F(Paths, NamesInAnUploadLeadNowhere) {
  start();
  for (const std::string& name :
       {std::string("../quad.gltf"), std::string("/quad.gltf"), std::string("a/../../quad.gltf"),
        std::string("C:quad.gltf"), std::string("a\\quad.gltf"), std::string("a//quad.gltf"),
        std::string("quad\n.gltf"), std::string("quad\0.gltf", 10), std::string("./quad.gltf")}) {
    Upload upload;
    upload.name = name;
    pb::LoadSceneResponse response;
    expect_status(load(upload.messages(), &response), StatusCode::INVALID_ARGUMENT, {"begin.main_file"});
  }
  // What an uploaded scene names is looked for among what was uploaded.
  auto gltf = nlohmann::json::parse(quad_gltf());
  gltf["buffers"][0]["uri"] = in("outside/secret.bin");
  Upload upload;
  upload.bytes = gltf.dump();
  pb::LoadSceneResponse response;
  EXPECT_FALSE(load(upload.messages(), &response).ok());
}

TEST_F(Paths, ListsShowNothingOutside) {
  start_roots();
  write_file(in("root/\x1b[2J.gltf"), quad_gltf());
  pb::ListFilesRequest request;
  pb::ListFilesResponse response;
  ASSERT_TRUE(call(&pb::RenderService::Stub::ListFiles, request, &response).ok());
  std::set<std::string> listed;
  for (const auto& entry : response.entries()) listed.insert(entry.path());
  EXPECT_EQ(listed, (std::set<std::string>{"sub", "quad.gltf", "inside.gltf"}));
  for (const char* folder : {"..", "linked", "relative", "../outside", "/"}) {
    request.set_folder(folder);
    EXPECT_EQ(call(&pb::RenderService::Stub::ListFiles, request, &response).error_code(), StatusCode::PERMISSION_DENIED)
        << folder;
  }
  request.set_folder(std::string("sub\0x", 5));
  EXPECT_EQ(call(&pb::RenderService::Stub::ListFiles, request, &response).error_code(), StatusCode::INVALID_ARGUMENT);
}

// A folder and a link to another take turns in one place while files are read through it.
TEST_F(Paths, ALinkThatComesBetweenCheckAndOpenLeadsNowhere) {
  EXPECT_TRUE(open_beneath(in("root"), "sub/quad.gltf", O_RDONLY));
  EXPECT_FALSE(open_beneath(in("root"), "linked/secret.gltf", O_RDONLY));
  EXPECT_FALSE(open_beneath(in("root"), "link.gltf", O_RDONLY));
  EXPECT_FALSE(open_beneath(in("root"), "sub/../quad.gltf", O_RDONLY));
  EXPECT_FALSE(open_beneath(in("root"), "/etc/passwd", O_RDONLY));

  write_file(in("root/place/file"), "public");
  write_file(in("outside/file"), kSecret);
  fs::create_directory_symlink(in("outside"), in("root/other"));
  std::atomic<bool> over = false;
  std::thread swapper([&] {
    while (!over) renameat2(AT_FDCWD, in("root/place").c_str(), AT_FDCWD, in("root/other").c_str(), RENAME_EXCHANGE);
  });
  const auto source = make_directory_source(in("root"));
  int read = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto bytes = source->read("place/file", 1 << 20);
    if (!bytes) continue;
    ++read;
    ASSERT_EQ(std::string(bytes->begin(), bytes->end()), "public");
  }
  over = true;
  swapper.join();
  EXPECT_GT(read, 0);
}

class OutputPaths : public KeptJobsTest {};

TEST_F(OutputPaths, OfJobsStayBelowTheirRoot) {
  start_daemon();
  fs::create_directories(folder_ / "elsewhere");
  fs::create_directory_symlink(folder_ / "elsewhere", out("linked"));
  pb::SubmitJobRequest asked = request(load_scene(), 16, 1);
  const auto refused = [&](const std::string& path) {
    asked.mutable_output()->set_path(path);
    pb::SubmitJobResponse response;
    return submit(asked, &response);
  };
  for (const std::string& path :
       {std::string("../picture.exr"), folder_ / "elsewhere/picture.exr", std::string("/tmp/picture.exr"),
        std::string("linked/picture.exr"), std::string("linked/../../picture.exr")}) {
    EXPECT_EQ(refused(path).error_code(), StatusCode::PERMISSION_DENIED) << path;
  }
  for (const std::string& path : {std::string("picture.exr\0.exr", 16), std::string("a\nb.exr"), std::string("..")})
    EXPECT_EQ(refused(path).error_code(), StatusCode::INVALID_ARGUMENT) << path;
  EXPECT_TRUE(fs::is_empty(folder_ / "elsewhere"));
}

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

TEST_F(OutputPaths, AFolderThatBecameALinkIsNotWrittenThrough) {
  fs::create_directories(out("sub"));
  fs::create_directories(folder_ / "elsewhere");
  const auto roots = OutputRoots::open(std::vector<std::string>{folder_ / "out"});
  ASSERT_TRUE(roots.ok());
  const auto file = roots->file_of("sub/picture.exr", 0, "output.path");
  ASSERT_TRUE(file.ok());
  EXPECT_TRUE(roots->write(*file, bytes_of("first"), false).ok());
  EXPECT_TRUE(roots->open(*file));
  fs::rename(out("sub"), out("before"));
  fs::create_directory_symlink(folder_ / "elsewhere", out("sub"));
  const Status written = roots->write(*file, bytes_of("second"), true);
  ASSERT_FALSE(written.ok());
  EXPECT_EQ(written.error().code, ErrorCode::permission_denied);
  EXPECT_TRUE(fs::is_empty(folder_ / "elsewhere"));
  write_file(folder_ / "elsewhere/picture.exr", kSecret);
  EXPECT_FALSE(roots->open(*file)) << "nor read";
}

TEST_F(OutputPaths, AFileThatCameMeanwhileIsNotLost) {
  fs::create_directories(folder_ / "out");
  const auto roots = OutputRoots::open(std::vector<std::string>{folder_ / "out"});
  ASSERT_TRUE(roots.ok());
  const auto file = roots->file_of("picture.exr", 0, "output.path");
  ASSERT_TRUE(file.ok());
  // Another process was faster.
  write_file(*file, "somebody else's");
  const Status written = roots->write(*file, bytes_of("ours"), false);
  ASSERT_FALSE(written.ok());
  EXPECT_EQ(written.error().code, ErrorCode::failed_precondition);
  EXPECT_EQ(read_file(*file), "somebody else's");
  fs::remove(*file);
  fs::create_symlink(folder_ / "nowhere", *file);
  EXPECT_FALSE(roots->write(*file, bytes_of("ours"), false).ok()) << "a link that leads nowhere is there, too";
  EXPECT_TRUE(roots->write(*file, bytes_of("ours"), true).ok());
  EXPECT_FALSE(fs::exists(folder_ / "nowhere"));
  EXPECT_EQ(read_file(*file), "ours");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "out"), fs::directory_iterator()), 1)
      << "a temporary file is left";
}

TEST_F(OutputPaths, AResultIsNotReadThroughALink) {
  start_daemon();
  pb::SubmitJobRequest asked = request(load_scene(), 16, 1);
  asked.mutable_output()->set_path("picture.exr");
  const std::string id = submitted(asked);
  ASSERT_EQ(wait_for(id, pb::JOB_STATE_SUCCEEDED).state(), pb::JOB_STATE_SUCCEEDED);
  ASSERT_FALSE(result(id).empty());
  write_file(folder_ / "secret", std::string(100000, 's'));
  fs::remove(out("picture.exr"));
  fs::create_symlink(folder_ / "secret", out("picture.exr"));
  std::string stolen;
  EXPECT_EQ(fetch(id, 0, &stolen).error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(stolen, "");
  const auto tiles = [&] {
    pb::GetResultRequest asked_for;
    asked_for.set_job_id(id);
    asked_for.mutable_tiles();
    grpc::ClientContext context;
    auto call = stub().GetResult(&context, asked_for);
    pb::GetResultResponse response;
    while (call->Read(&response)) {
    }
    return call->Finish();
  };
  const std::string small(1000, 's');
  write_file(folder_ / "small secret", small);
  fs::remove(out("picture.exr"));
  fs::create_symlink(folder_ / "small secret", out("picture.exr"));
  EXPECT_EQ(tiles().error_code(), StatusCode::NOT_FOUND) << "nor for tiles";
  // Whoever may write there learns of another file not even its hash.
  fs::remove(out("picture.exr"));
  fs::create_hard_link(folder_ / "small secret", out("picture.exr"));
  Sha256 hash;
  hash.update(small);
  const grpc::Status refused = tiles();
  EXPECT_EQ(refused.error_code(), StatusCode::INTERNAL);
  EXPECT_EQ(refused.error_message().find(to_hex(hash.finish())), std::string::npos) << refused.error_message();
}

}  // namespace
}  // namespace helio::test
