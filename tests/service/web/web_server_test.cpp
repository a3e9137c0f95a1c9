// The page's server as browsers and what is no browser meet it.
#include "server/web/web_server.h"

#include <zlib.h>

#include <filesystem>

#include "heliograph/v1/web.pb.h"
#include "process.h"
#include "server/scenes/scene_roots.h"
#include "service_fixture.h"
#include "web/web_peer.h"

namespace helio::test {
namespace {

const std::string kToken = "a token of the tests";  // spaces: no file could hold it
const std::string kGoodToken = "0123456789abcdef";

std::string gunzip(const std::string& bytes) {
  z_stream stream{};
  EXPECT_EQ(inflateInit2(&stream, 16 + MAX_WBITS), Z_OK);
  std::string out(1 << 22, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = uInt(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = uInt(out.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  inflateEnd(&stream);
  return out;
}

class WebServerTest : public ServiceTest {
 protected:
  void start_web(const std::function<void(ServerConfig&)>& change = {}) {
    start([&](ServerConfig& config) {
      config.http = "127.0.0.1:0";
      if (change) change(config);
    });
  }
  const std::string& http() const { return server_->http_address(); }
};

// A page's calls, by the envelope.
class Page {
 public:
  explicit Page(const std::string& address, const std::string& token = {}) : peer_(address) {
    EXPECT_EQ(peer_.upgrade().status, 101);
    pb::WebRequest hello;
    hello.mutable_hello()->set_envelope(1);
    hello.mutable_hello()->set_token(token);
    send(hello);
  }

  void send(const pb::WebRequest& request) { peer_.send_message(request.SerializeAsString()); }
  // The next message; nothing: the socket was closed, by what closed() tells.
  std::optional<pb::WebResponse> read() {
    const auto frame = peer_.read_frame();
    if (!frame || frame->opcode != 2) {
      if (frame) closed_ = *frame;
      return std::nullopt;
    }
    pb::WebResponse response;
    EXPECT_TRUE(response.ParseFromString(frame->payload));
    return response;
  }
  // Sends one request and gives its answer; `status` that of the call.
  pb::WebResponse call(pb::WebRequest request, pb::WebResponse::Status* status = nullptr) {
    request.set_id(++last_id_);
    send(request);
    pb::WebResponse answer;
    while (auto response = read()) {
      if (response->id() != last_id_) continue;
      if (response->has_status()) {
        if (status) *status = response->status();
        break;
      }
      answer = *response;
    }
    return answer;
  }
  std::uint64_t new_id() { return ++last_id_; }
  bool welcomed() {
    const auto response = read();
    return response && response->has_welcome();
  }
  const WebFrame& closed() const { return closed_; }
  WebPeer& peer() { return peer_; }

 private:
  WebPeer peer_;
  WebFrame closed_;
  std::uint64_t last_id_ = 0;
};

// ---- HTTP ----------------------------------------------------------------------------------------------------------

TEST_F(WebServerTest, ServesThePageWithAStrictPolicy) {
  start_web();
  WebPeer peer(http());
  const HttpAnswer page = peer.get("/");
  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.headers.at("content-type"), "text/html; charset=utf-8");
  EXPECT_NE(page.body.find("<!doctype html>"), std::string::npos);
  const std::string policy = page.headers.at("content-security-policy");
  EXPECT_EQ(policy.find("unsafe"), std::string::npos);
  EXPECT_NE(policy.find("default-src 'none'"), std::string::npos);
  EXPECT_NE(policy.find("frame-ancestors 'none'"), std::string::npos);
  EXPECT_EQ(page.headers.at("x-content-type-options"), "nosniff");

  // On the same connection.
  EXPECT_EQ(peer.get("/index.html?a=b").body, page.body);
  const HttpAnswer packed = peer.get("/", {{"Accept-Encoding", "br, gzip"}});
  EXPECT_EQ(packed.headers.at("content-encoding"), "gzip");
  EXPECT_LT(packed.body.size(), page.body.size());
  EXPECT_EQ(gunzip(packed.body), page.body);
  const HttpAnswer known = peer.get("/", {{"If-None-Match", page.headers.at("etag")}});
  EXPECT_EQ(known.status, 304);
  EXPECT_TRUE(known.body.empty());
  const HttpAnswer head = peer.get("/", {}, "HEAD");
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.headers.at("content-length"), std::to_string(page.body.size()));
}

TEST_F(WebServerTest, ServesEveryFileThatThePageNames) {
  start_web();
  WebPeer peer(http());
  const std::filesystem::path folder = std::filesystem::path(HELIO_SOURCE_DIR) / "client/web";
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    const std::string ending = entry.path().extension().string();
    if (!entry.is_regular_file() || (ending != ".js" && ending != ".css" && ending != ".html")) continue;
    const std::string path = entry.path().lexically_relative(folder).generic_string();
    const HttpAnswer answer = peer.get("/" + path);
    EXPECT_EQ(answer.status, 200) << path;
    EXPECT_EQ(answer.body, read_file(entry.path().string())) << path;
    ++files;
  }
  EXPECT_GT(files, 5);
}

TEST_F(WebServerTest, AnswersWhatItDoesNotServe) {
  start_web();
  struct Case {
    std::string method, path;
    int status;
    std::string part;
  };
  const Case cases[] = {{"GET", "/nothing", 404, "the viewer is at /"},
                        {"GET", "/../server/README.md", 404, "no such page"},
                        {"GET", "nothing", 404, "no such page"},
                        {"POST", "/", 405, "GET and HEAD"},
                        {"BREW", "/", 405, "GET and HEAD"},
                        {"GET", "/ws", 426, "WebSocket"}};
  for (const Case& c : cases) {
    const HttpAnswer answer = WebPeer(http()).get(c.path, {}, c.method);
    EXPECT_EQ(answer.status, c.status) << c.path;
    EXPECT_NE(answer.body.find(c.part), std::string::npos) << answer.body;
  }
  EXPECT_EQ(WebPeer(http()).get("/", {{"Content-Length", "5"}}).status, 400);  // bodies are not taken
  EXPECT_EQ(WebPeer(http()).get("/", {{"X-Large", std::string(9000, 'a')}}).status, 431);
  WebPeer rubbish(http());
  rubbish.send("\x16\x03\x01 rubbish\r\n\r\n");
  EXPECT_EQ(rubbish.read_answer().status, 400);
  EXPECT_TRUE(rubbish.ended());
}

TEST_F(WebServerTest, RefusesOtherHosts) {
  start_web([](ServerConfig& config) { config.http_hosts = {"render.example"}; });
  for (const char* host : {"localhost:99", "LOCALHOST", "[::1]:7", "127.0.0.1", "render.example:80"}) {
    EXPECT_EQ(WebPeer(http()).get("/", {{"Host", host}}).status, 200) << host;
  }
  for (const char* host : {"evil.example", "127.0.0.1.evil.example", "localhost:", "localhost:x", "", "127.0.0.1:1:2",
                           "[::1", "localhost@evil.example"}) {
    const HttpAnswer answer = WebPeer(http()).get("/", {{"Host", host}});
    EXPECT_EQ(answer.status, 403) << host;
    EXPECT_NE(answer.body.find("--http-host"), std::string::npos);
  }
  EXPECT_EQ(WebPeer(http()).get("/healthz", {{"Host", "10.0.0.7:8080"}}).body, "ok\n");
}

TEST_F(WebServerTest, BoundsItsConnectionsAndTheirPatience) {
  start();
  WebServer::Options options;
  options.listen = "127.0.0.1:0";
  options.max_connections = 2;
  options.patience_s = 0.3;
  auto web = WebServer::listen(options);
  ASSERT_TRUE(web.ok());
  (*web)->serve({});
  (*web)->open(server_->in_process_channel());
  {
    WebPeer silent((*web)->address()), slow((*web)->address());
    slow.send("GET / HTTP/1.1\r\nHost: loc");
    WebPeer third((*web)->address());
    const HttpAnswer refused = third.read_answer();
    EXPECT_EQ(refused.status, 503);
    EXPECT_TRUE(silent.ended());
    EXPECT_TRUE(slow.ended());
  }
  EXPECT_TRUE(eventually([&] { return WebPeer((*web)->address()).get("/healthz").status == 200; }));
  WebPeer mute((*web)->address());
  EXPECT_EQ(mute.upgrade().status, 101);
  const auto closed = mute.read_frame();
  ASSERT_TRUE(closed);
  EXPECT_EQ(closed->close_code(), 4408);
  EXPECT_NE(closed->close_reason().find("hello"), std::string::npos);
}

TEST_F(WebServerTest, SaysWhereItCannotListen) {
  start_web();
  ServerConfig config;
  config.http = http();
  const auto second = Server::start(config);
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::unavailable);
  EXPECT_EQ(second.error().where, "http");
  config.http = "0.0.0.0:0";
  config.insecure = true;
  const auto open = Server::start(config);
  ASSERT_FALSE(open.ok());
  EXPECT_NE(open.error().message.find("--token-file"), std::string::npos) << open.error().message;
}

// ---- WebSocket -----------------------------------------------------------------------------------------------------

TEST_F(WebServerTest, RefusesPagesFromElsewhere) {
  start_web();
  for (const char* origin : {"http://evil.example", "null", "", "http://127.0.0.1:1", "ftp://127.0.0.1"}) {
    const HttpAnswer answer = WebPeer(http()).upgrade({{"Origin", origin}});
    EXPECT_EQ(answer.status, 403) << origin;
    EXPECT_NE(answer.body.find("Origin"), std::string::npos);
  }
  EXPECT_EQ(WebPeer(http()).upgrade({{"Host", "localhost:7"}, {"Origin", "http://localhost:7"}}).status, 101);
  EXPECT_EQ(WebPeer(http()).upgrade({{"Sec-WebSocket-Protocol", "other"}}).status, 400);
  EXPECT_EQ(WebPeer(http()).upgrade({{"Sec-WebSocket-Protocol", ""}}).status, 400);
}

TEST_F(WebServerTest, ClosesWithASentence) {
  start_web();
  const auto closing = [&](const std::function<void(WebPeer&)>& act) {
    WebPeer peer(http());
    EXPECT_EQ(peer.upgrade().status, 101);
    act(peer);
    for (;;) {
      const auto frame = peer.read_frame();
      if (!frame || frame->opcode == 8) return frame.value_or(WebFrame());
    }
  };
  pb::WebRequest hello;
  hello.mutable_hello()->set_envelope(1);
  const std::string greeting = hello.SerializeAsString();
  struct Case {
    std::function<void(WebPeer&)> act;
    int code;
    std::string part;
  };
  const Case cases[] = {
      {[](WebPeer& p) { p.send_frame(1, "text"); }, 1003, "binary"},
      {[](WebPeer& p) { p.send_message("\xff\xff\xff"); }, 1007, "not a well-formed"},
      {[](WebPeer& p) {
         p.send_message(
             "\x22\x7f"
             "cut");
       },
       1007, "not a well-formed"},
      {[](WebPeer& p) { p.send_message(""); }, 1002, "hello"},
      {[&](WebPeer& p) { hello.mutable_hello()->set_envelope(2), p.send_message(hello.SerializeAsString()); }, 4400,
       "load the page again"},
      {[&](WebPeer& p) { p.send_message(greeting), p.send_message(greeting); }, 1002, "twice"},
      // A call without a number.
      {[&](WebPeer& p) { p.send_message(greeting), p.send_message(std::string("\x82\x01\x00", 3)); }, 1002, "id"},
      // By the transport, which gives no reason.
      {[](WebPeer& p) { p.send_frame(1, "\xc3\x28"); }, 1007, ""},
      {[](WebPeer& p) { p.send_frame(3, ""); }, 1002, ""},
      {[](WebPeer& p) { p.send_frame(2, "unmasked", false); }, 1002, ""},
      {[](WebPeer& p) { p.send_message(std::string((4 << 20) + 65, 'a')); }, 1009, ""},
  };
  for (std::size_t i = 0; i < std::size(cases); ++i) {
    const WebFrame closed = closing(cases[i].act);
    EXPECT_EQ(closed.close_code(), cases[i].code) << i;
    EXPECT_NE(closed.close_reason().find(cases[i].part), std::string::npos) << i << ": " << closed.close_reason();
  }
}

TEST_F(WebServerTest, AnswersCallsAndTellsTheirErrors) {
  start_web();
  Page page(http());
  ASSERT_TRUE(page.welcomed());
  pb::WebRequest request;
  request.mutable_get_server_info();
  pb::WebResponse::Status status;
  EXPECT_EQ(page.call(request, &status).get_server_info().http_address(), http());
  EXPECT_EQ(status.code(), 0);

  request.mutable_close_session()->set_session_id("there-is-none");
  page.call(request, &status);
  EXPECT_EQ(status.code(), int(grpc::StatusCode::NOT_FOUND));
  EXPECT_NE(status.message().find("session_id"), std::string::npos);

  request.Clear();
  request.set_id(page.new_id());
  page.peer().send_message(request.SerializeAsString() + std::string("\xfa\x3e\x00", 3));  // field 1007, empty
  const auto unknown = page.read();
  ASSERT_TRUE(unknown);
  EXPECT_EQ(unknown->status().code(), int(grpc::StatusCode::UNIMPLEMENTED));
  EXPECT_NE(unknown->status().message().find("1007"), std::string::npos);

  // Fields of a newer page are named.
  request.Clear();
  request.set_id(page.new_id());
  pb::GetServerInfoRequest newer;
  newer.GetReflection()->MutableUnknownFields(&newer)->AddVarint(99, 1);
  *request.mutable_get_server_info() = newer;
  page.send(request);
  std::string ignored;
  while (const auto response = page.read()) {
    if (!response->has_status()) continue;
    if (response->status().ignored_fields_size() > 0) ignored = response->status().ignored_fields(0);
    break;
  }
  EXPECT_EQ(ignored, "field 99 of GetServerInfoRequest");
}

TEST_F(WebServerTest, CarriesAnUploadASessionAndItsTiles) {
  start_web();
  Page page(http());
  ASSERT_TRUE(page.welcomed());
  pb::WebRequest request;
  const std::uint64_t load = page.new_id();
  for (const pb::LoadSceneRequest& message : Upload().messages()) {
    request.set_id(load);
    *request.mutable_load_scene() = message;
    page.send(request);
  }
  request.Clear();
  request.set_id(load);
  request.mutable_end();
  page.send(request);
  std::string scene;
  while (const auto response = page.read()) {
    if (response->has_load_scene()) scene = response->load_scene().scene().scene_id();
    if (response->has_status()) break;
  }
  ASSERT_FALSE(scene.empty());

  request.Clear();
  request.mutable_create_session()->set_scene_id(scene);
  request.mutable_create_session()->mutable_settings()->set_width(40);
  request.mutable_create_session()->mutable_settings()->set_height(30);
  request.mutable_create_session()->mutable_budget()->set_samples(2);
  const std::string session = page.call(request).create_session().session_id();
  ASSERT_FALSE(session.empty());

  const std::uint64_t stream = page.new_id();
  request.Clear();
  request.set_id(stream);
  request.mutable_stream_frames()->mutable_open()->set_session_id(session);
  page.send(request);
  *request.mutable_stream_frames()->mutable_view() = view(1);
  page.send(request);
  bool opened = false;
  int tiles = 0, pixels = 0;
  while (const auto response = page.read()) {
    ASSERT_EQ(response->id(), stream);
    ASSERT_TRUE(response->has_stream_frames()) << response->ShortDebugString();
    opened = opened || response->stream_frames().has_opened();
    if (response->stream_frames().has_tile()) {
      const pb::Tile& tile = response->stream_frames().tile();
      ++tiles;
      if (tile.final()) pixels += (tile.window().x1() - tile.window().x0()) * (tile.window().y1() - tile.window().y0());
      EXPECT_EQ(crc32(0, reinterpret_cast<const Bytef*>(tile.exr().data()), uInt(tile.exr().size())), tile.crc32());
    }
    if (response->stream_frames().has_frame_end()) break;
  }
  EXPECT_TRUE(opened);
  EXPECT_GT(tiles, 0);
  EXPECT_EQ(pixels, 40 * 30);
  EXPECT_TRUE(session_info(session).attached());

  // The stream ends with the page's connection, the session does not.
  {
    Page other(http());
    ASSERT_TRUE(other.welcomed());
    request.set_id(other.new_id());
    request.mutable_stream_frames()->mutable_open()->set_session_id(session);
    other.send(request);
    const auto first = other.read();
    ASSERT_TRUE(first && first->stream_frames().has_opened());
    EXPECT_TRUE(first->stream_frames().opened().resumed());
    // When it goes, nothing is on its way to it.
    EXPECT_TRUE(comes_to_rest(session));
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  }
  EXPECT_TRUE(eventually([&] { return !session_info(session).attached(); }));
  EXPECT_EQ(session_info(session).session_id(), session);
}

// More at once than is taken from the socket before the service has it.
TEST_F(WebServerTest, CarriesALargeUpload) {
  start_web();
  Page page(http());
  ASSERT_TRUE(page.welcomed());
  constexpr std::size_t kChunk = 1 << 20, kChunks = 64;
  Upload scene, rest;
  rest.name = "rest.bin";
  rest.bytes.assign(kChunk * kChunks, 'r');
  pb::LoadSceneRequest begin = scene.begin();
  begin.mutable_begin()->set_total_bytes(scene.bytes.size() + rest.bytes.size());
  std::vector<pb::LoadSceneRequest> messages{begin, scene.begin_file(), scene.data(), rest.begin_file()};
  pb::LoadSceneRequest data;
  data.set_data(std::string(kChunk, 'r'));
  messages.insert(messages.end(), kChunks, data);
  pb::WebRequest request;
  request.set_id(page.new_id());
  for (const pb::LoadSceneRequest& message : messages) {
    *request.mutable_load_scene() = message;
    page.send(request);
  }
  request.mutable_end();
  page.send(request);
  bool loaded = false;
  std::optional<pb::WebResponse> response;
  while ((response = page.read()) && !response->has_status()) loaded = loaded || response->has_load_scene();
  ASSERT_TRUE(response) << "the connection has ended";
  EXPECT_EQ(response->status().code(), 0) << response->status().message();
  EXPECT_TRUE(loaded);
}

TEST_F(WebServerTest, APageThatStopsReadingHoldsNothingUp) {
  start_web();
  const std::string scene = load_quad();
  const std::string session = create_session(scene, 512, 512);
  Page still(http()), other(http());
  ASSERT_TRUE(still.welcomed());
  ASSERT_TRUE(other.welcomed());
  pb::WebRequest request;
  request.set_id(still.new_id());
  request.mutable_stream_frames()->mutable_open()->set_session_id(session);
  still.send(request);
  *request.mutable_stream_frames()->mutable_view() = view(1);
  still.send(request);
  // Its samples go on while nothing of them is read.
  EXPECT_TRUE(eventually([&] { return session_info(session).progress().samples_per_pixel() > 3; }));
  request.Clear();
  request.mutable_get_server_info();
  EXPECT_GT(other.call(request).get_server_info().threads(), 0);
}

TEST_F(WebServerTest, APageThatOnlySendsIsReadNoFurther) {
  start_web();
  Page page(http());
  ASSERT_TRUE(page.welcomed());
  // Each of a kind that this daemon does not know, and answered; nothing is read.
  bool taken = true;
  std::uint64_t sent = 0;
  const std::string unknown("\xfa\x3e\x00", 3);
  pb::WebRequest request;
  std::string many;
  page.peer().set_patience(1);
  for (; taken && sent < 2000000; sent += 1000) {
    many.clear();
    for (int i = 0; i < 1000; ++i) {
      request.set_id(page.new_id());
      many += WebPeer::frame(2, request.SerializeAsString() + unknown);
    }
    taken = page.peer().send(many);
  }
  EXPECT_FALSE(taken) << "the daemon took " << sent << " requests";
}

TEST_F(WebServerTest, WantsATokenEverywhere) {
  TemporaryFolder folder;
  write_file(folder / "tokens", "# ours\n" + kGoodToken + "\n");
  start_web([&](ServerConfig& config) { config.token_file = folder / "tokens"; });
  for (const std::string& token : {std::string(), kToken, kGoodToken + "0", std::string(100000, 'a')}) {
    Page refused(http(), token);
    EXPECT_FALSE(refused.welcomed());
    EXPECT_EQ(refused.closed().close_code(), 4401);
  }
  Page page(http(), kGoodToken);
  ASSERT_TRUE(page.welcomed());
  pb::WebRequest request;
  request.mutable_list_scenes();
  pb::WebResponse::Status status;
  page.call(request, &status);
  EXPECT_EQ(status.code(), 0) << status.message();
  // No header of HTTP gives it away.
  EXPECT_EQ(WebPeer(http()).get("/").body.find(kGoodToken), std::string::npos);

  pb::ListScenesResponse response;
  EXPECT_EQ(call(&pb::RenderService::Stub::ListScenes, pb::ListScenesRequest(), &response).error_code(),
            grpc::StatusCode::UNAUTHENTICATED);
  StreamClient stream(stub());
  EXPECT_EQ(stream.status().error_code(), grpc::StatusCode::UNAUTHENTICATED);
  grpc::ClientContext context;
  context.AddMetadata("authorization", "Bearer " + kGoodToken);
  EXPECT_TRUE(stub().ListScenes(&context, pb::ListScenesRequest(), &response).ok());
}

TEST_F(WebServerTest, DrainsLikeAnyOtherClient) {
  start_web();
  const std::string session = create_session(load_quad(), 16, 16);
  Page page(http());
  ASSERT_TRUE(page.welcomed());
  pb::WebRequest request;
  request.set_id(page.new_id());
  request.mutable_stream_frames()->mutable_open()->set_session_id(session);
  page.send(request);
  ASSERT_TRUE(page.read());
  EXPECT_EQ(WebPeer(http()).get("/readyz").status, 200);
  server_->drain(1);
  int code = -1;
  while (const auto response = page.read()) {
    if (response->has_status()) code = response->status().code();
  }
  EXPECT_EQ(code, int(grpc::StatusCode::UNAVAILABLE));
  EXPECT_EQ(page.closed().close_code(), 1001);
}

// ---- what a person picks from --------------------------------------------------------------------------------------

TEST_F(WebServerTest, DescribesWhatMayBeEdited) {
  start_web();
  pb::DescribeSceneRequest request;
  request.set_scene_id(load_quad(2));
  pb::DescribeSceneResponse parts;
  ASSERT_TRUE(call(&pb::RenderService::Stub::DescribeScene, request, &parts).ok());
  ASSERT_EQ(parts.objects_size(), 1);
  EXPECT_EQ(parts.object_total(), 1u);
  EXPECT_EQ(parts.objects(0).triangles(), 2u);
  EXPECT_EQ(parts.objects(0).transform_size(), 12);
  EXPECT_EQ(parts.objects(0).transform(0), 1);
  ASSERT_GT(parts.materials_size(), 0);
  EXPECT_EQ(parts.materials(int(parts.objects(0).material())).emission().x(), 2);
  EXPECT_EQ(parts.materials(0).model(), "metallic_roughness");
  EXPECT_EQ(parts.environment().x(), 0);
  EXPECT_TRUE(parts.has_environment());

  request.set_first_object(2);
  expect_status(call(&pb::RenderService::Stub::DescribeScene, request, &parts), grpc::StatusCode::INVALID_ARGUMENT,
                {"first_object: 2; allowed: [0, 1]"});
  request.set_scene_id("none");
  EXPECT_FALSE(call(&pb::RenderService::Stub::DescribeScene, request, &parts).ok());
}

TEST_F(WebServerTest, ListsFilesBelowTheRootsAlone) {
  TemporaryFolder folder, outside;
  std::filesystem::create_directory(folder / "rooms");
  write_file(folder / "rooms/a.gltf", quad_gltf());
  write_file(folder / "sky.EXR", "not looked into");
  write_file(folder / "notes.txt", "no scene");
  write_file(folder / ".hidden.glb", "");
  write_file(outside / "secret.glb", "");
  std::filesystem::create_symlink(outside.path(), folder / "link");
  std::filesystem::create_symlink(outside / "secret.glb", folder / "secret.glb");
  start_web([&](ServerConfig& config) { config.scene_roots = {folder.path()}; });
  const auto list = [&](const std::string& path, pb::ListFilesResponse* files) {
    pb::ListFilesRequest request;
    request.set_folder(path);
    return call(&pb::RenderService::Stub::ListFiles, request, files);
  };
  pb::ListFilesResponse files;
  ASSERT_TRUE(list("", &files).ok());
  ASSERT_EQ(files.entries_size(), 2) << files.ShortDebugString();
  EXPECT_EQ(files.total(), 2u);
  EXPECT_EQ(files.entries(0).path(), "rooms");
  EXPECT_TRUE(files.entries(0).folder());
  EXPECT_EQ(files.entries(1).path(), "sky.EXR");
  EXPECT_TRUE(files.entries(1).environment());
  EXPECT_EQ(files.entries(1).bytes(), 15u);
  ASSERT_TRUE(list("rooms", &files).ok());
  ASSERT_EQ(files.entries_size(), 1);
  EXPECT_EQ(files.entries(0).path(), "rooms/a.gltf");
  pb::LoadSceneRequest load;
  load.mutable_begin()->set_path(files.entries(0).path());
  pb::LoadSceneResponse loaded;
  EXPECT_TRUE(this->load({load}, &loaded).ok());
  // A folder that two roots have is that of both.
  TemporaryFolder second;
  std::filesystem::create_directory(second / "rooms");
  write_file(second / "rooms/a.gltf", "the first root's hides it");
  write_file(second / "rooms/b.glb", "");
  const auto roots = SceneRoots::open({folder.path(), second.path()});
  ASSERT_TRUE(roots.ok());
  const auto both = roots->list("rooms", "folder");
  ASSERT_TRUE(both.ok());
  ASSERT_EQ(both->entries.size(), 2u);
  EXPECT_EQ(both->entries[0].bytes, quad_gltf().size());
  EXPECT_EQ(both->entries[1].path, "rooms/b.glb");
  EXPECT_EQ(list("link", &files).error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(list("..", &files).error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(list("/", &files).error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(list("nowhere", &files).error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(WebServerTest, ServesNoFilesWithoutRoots) {
  start_web();
  pb::ListFilesResponse files;
  EXPECT_EQ(call(&pb::RenderService::Stub::ListFiles, pb::ListFilesRequest(), &files).error_code(),
            grpc::StatusCode::PERMISSION_DENIED);
}

}  // namespace
}  // namespace helio::test
