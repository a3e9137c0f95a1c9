// What /metrics tells of a daemon, who may read it, and what health says.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>
#include <regex>
#include <thread>

#include "jobs/kept_jobs_fixture.h"
#include "metrics/metrics_text.h"
#include "server/metrics/rpc_counts.h"
#include "server/state/sqlite_database.h"
#include "server/stream/outbound_queue.h"
#include "server/web/web_access.h"
#include "service_fixture.h"
#include "web/web_peer.h"

namespace helio::test {
namespace {

const std::string kToken = "0123456789abcdef";

class MetricsTest : public KeptJobsTest {
 protected:
  void start_with_page(const std::function<void(ServerConfig&)>& change = {}) {
    start_daemon([&](ServerConfig& config) {
      config.http = "127.0.0.1:0";
      if (change) change(config);
    });
  }
  MetricsText scrape() {
    const HttpAnswer answer = WebPeer(server_->http_address()).get("/metrics");
    EXPECT_EQ(answer.status, 200) << answer.body;
    return MetricsText(answer.body);
  }
  // RunJob to its end; its messages as the bytes that came.
  std::vector<pb::RunJobResponse> run_job(const std::string& scene, int width, int height, std::uint32_t samples,
                                          std::size_t* bytes = nullptr) {
    pb::RunJobRequest request;
    request.set_scene_id(scene);
    request.mutable_settings()->set_width(width);
    request.mutable_settings()->set_height(height);
    request.mutable_budget()->set_samples(samples);
    const RawAnswer answer = send_raw(new_channel(), kRenderService + "RunJob", {request.SerializeAsString()});
    EXPECT_TRUE(answer.status.ok()) << answer.status.error_message();
    std::vector<pb::RunJobResponse> messages;
    for (const std::string& message : answer.messages) {
      if (bytes) *bytes += message.size();
      messages.emplace_back();
      EXPECT_TRUE(messages.back().ParseFromString(message));
    }
    return messages;
  }
};

// ---- The format ----------------------------------------------------------------------------------------------------

// Rows "| `name` | type | labels | meaning |" of the manual's table.
struct Row {
  std::string type;
  std::set<std::string> labels;
};
std::map<std::string, Row> rows_of_the_manual() {
  std::ifstream manual(std::string(HELIO_SOURCE_DIR) + "/server/README.md");
  const std::regex row(R"(\| `((?:heliograph|process)_[a-z_]+)` \| (counter|gauge|histogram) \|([^|]*)\| [^|]+ \|)");
  std::map<std::string, Row> rows;
  for (std::string line; std::getline(manual, line);) {
    std::smatch parts;
    if (!std::regex_match(line, parts, row)) continue;
    Row& here = rows[parts[1]];
    EXPECT_EQ(here.type, "") << parts[1] << " is there twice";
    here.type = parts[2];
    const std::string labels = parts[3];
    static const std::regex kLabel("`([a-z]+)`");
    for (std::sregex_iterator label(labels.begin(), labels.end(), kLabel), end; label != end; ++label)
      here.labels.insert((*label)[1]);
  }
  return rows;
}

TEST_F(MetricsTest, AreThoseOfTheManual) {
  start_with_page();
  const HttpAnswer answer = WebPeer(server_->http_address()).get("/metrics");
  EXPECT_EQ(answer.headers.at("content-type"), "text/plain; version=0.0.4; charset=utf-8");
  load_quad();  // a call that has ended
  const MetricsText text = scrape();
  const auto rows = rows_of_the_manual();
  EXPECT_GT(rows.size(), 25u);
  for (const auto& [name, family] : text.families()) {
    const auto row = rows.find(name);
    ASSERT_NE(row, rows.end()) << name << " has no row in server/README.md";
    EXPECT_EQ(family.type, row->second.type) << name;
    EXPECT_EQ(family.label_names(), row->second.labels) << name;
  }
  for (const auto& [name, row] : rows) EXPECT_TRUE(text.families().contains(name)) << name;
}

// No label holds what clients choose, so the number of series has a bound.
TEST_F(MetricsTest, HaveNoLabelsOfClients) {
  start_with_page();
  const std::string scene = load_scene(), session = create_session(load_quad(), 16, 16);
  pb::SubmitJobRequest job = request(scene, 16, 2);
  job.set_name("\"a\"{b=\"c\"}");
  const std::string id = submitted(job);
  wait_for(id, pb::JOB_STATE_SUCCEEDED);
  const std::string body = WebPeer(server_->http_address()).get("/metrics").body;
  for (const std::string& name : {scene.substr(0, 12), session, id, std::string("cornell"), folder_.path()})
    EXPECT_EQ(body.find(name), std::string::npos) << name;
}

// ---- Counts --------------------------------------------------------------------------------------------------------

TEST_F(MetricsTest, CountSamplesRaysAndBytesToTheLast) {
  start_with_page();
  const std::string scene = load_scene();
  const MetricsText before = scrape();
  EXPECT_EQ(before.value("heliograph_samples_total"), 0);
  std::size_t bytes = 0;
  const auto messages = run_job(scene, 60, 34, 6, &bytes);
  const MetricsText after = scrape();
  EXPECT_EQ(after.value("heliograph_samples_total"), 60 * 34 * 6);
  ASSERT_TRUE(messages.back().has_result());
  EXPECT_EQ(after.value("heliograph_rays_total"), double(messages.back().result().end().totals().rays()));
  EXPECT_EQ(after.value("heliograph_stream_bytes_total"), double(bytes));
  const auto tiles = std::count_if(messages.begin(), messages.end(), [](const auto& m) { return m.has_tile(); });
  EXPECT_EQ(after.value("heliograph_stream_tiles_total"), double(tiles));
  EXPECT_EQ(after.value("heliograph_invalid_samples_total"), 0);
  EXPECT_GT(after.value("heliograph_render_seconds_total"), 0);

  // A job that is kept, with as many samples again as it has.
  const std::string id = submitted(request(scene, 32, 10));
  EXPECT_EQ(wait_for(id, pb::JOB_STATE_SUCCEEDED).state(), pb::JOB_STATE_SUCCEEDED);
  const MetricsText last = scrape();
  EXPECT_EQ(last.value("heliograph_samples_total"), 60 * 34 * 6 + 32 * 32 * 10);
  EXPECT_EQ(last.value("heliograph_stream_bytes_total"), double(bytes)) << "nobody took its tiles";
  EXPECT_EQ(last.value("heliograph_jobs", {{"kind", "kept"}, {"state", "succeeded"}}), 1);
  EXPECT_TRUE(eventually([&] { return scrape().value("heliograph_jobs_ended_total", {{"state", "succeeded"}}) == 1; }));
}

TEST_F(MetricsTest, CountTheBytesOfAStreamAsItsClientDoes) {
  start_with_page();
  StreamClient client(stub(), create_session(load_quad(), 200, 140, 4));
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for_frame_end(1));
  client.half_close();
  EXPECT_TRUE(client.status().ok());
  std::size_t bytes = 0, tiles = 0;
  for (const pb::StreamResponse& message : client.reader().messages()) {
    bytes += message.ByteSizeLong();
    tiles += message.has_tile();
  }
  const MetricsText text = scrape();
  EXPECT_EQ(text.value("heliograph_stream_bytes_total"), double(bytes));
  EXPECT_EQ(text.value("heliograph_stream_tiles_total"), double(tiles));
  EXPECT_EQ(text.value("heliograph_samples_total"), 200 * 140 * 4);
}

TEST_F(MetricsTest, CountInvalidSamples) {
  start_with_page();
  Upload upload;
  upload.bytes = overflowing_gltf();
  pb::LoadSceneResponse loaded;
  ASSERT_TRUE(load(upload.messages(), &loaded).ok());
  const auto messages = run_job(loaded.scene().scene_id(), 64, 64, 16);
  const auto invalid = messages.back().result().invalid_samples();
  EXPECT_GT(invalid, 0u);
  EXPECT_EQ(scrape().value("heliograph_invalid_samples_total"), double(invalid));
}

// Of two tiles at one place the first is superseded; of a frame that waits, all tiles are, when a newer view comes.
TEST(Superseded, TilesAreCountedWhereTheyAreDropped) {
  StreamCounters counters;
  OutboundQueue queue(&counters);
  const auto begin = [](std::uint64_t revision, double changed_s) {
    FrameBegin begin;
    begin.tag = {revision, revision, revision};
    begin.changed_s = changed_s;
    return begin;
  };
  const auto tile = [](std::uint64_t revision, int x) {
    EncodedTile tile;
    tile.tag = {revision, revision, revision};
    tile.window = {x, 0, x + 10, 10};
    tile.bytes.resize(10);
    return tile;
  };
  queue.push(begin(1, 7.5));
  for (const int x : {0, 10, 0}) queue.push(tile(1, x));
  EXPECT_EQ(counters.superseded_tiles.value(), 1u);
  queue.pop(0);
  // The age is told with the first tile of each place.
  EXPECT_EQ(std::get<EncodedTile>(*queue.pop(0).message).changed_s, 7.5);
  queue.push(tile(1, 0));
  EXPECT_EQ(std::get<EncodedTile>(*queue.pop(0).message).changed_s, 7.5) << "of the other place";
  EXPECT_EQ(std::get<EncodedTile>(*queue.pop(0).message).changed_s, 0);
  for (const int x : {0, 10}) queue.push(tile(1, x));
  queue.drop_before(2);
  EXPECT_EQ(counters.superseded_tiles.value(), 3u);
  queue.push(begin(2, 0));
  queue.push(tile(2, 0));
  queue.close();
  EXPECT_EQ(counters.superseded_tiles.value(), 3u) << "nobody waits for it any more";
}

TEST_F(MetricsTest, TellHowOldPicturesAre) {
  start_with_page();
  const std::string session = create_session(load_quad(), 256, 256, 4);  // four tiles
  const auto first_tiles = [](const MetricsText& text) {
    return text.value("heliograph_first_tile_seconds_count", {{"picture", "film"}});
  };
  const auto ages = [](const MetricsText& text) {
    return text.value("heliograph_picture_age_seconds_count", {{"picture", "film"}});
  };
  {
    StreamClient client(stub(), session);
    client.send(view(1));
    ASSERT_TRUE(client.reader().wait_for_frame_end(1));
    MetricsText text = scrape();
    EXPECT_EQ(first_tiles(text), 1);
    EXPECT_EQ(ages(text), 4);
    EXPECT_GT(text.value("heliograph_picture_age_seconds_sum", {{"picture", "film"}}), 0);
    // The same picture with more samples is no new one.
    pb::Budget budget;
    budget.set_samples(8);
    client.send(budget);
    ASSERT_TRUE(client.reader().wait_for(
        [](const auto& m) { return m.has_frame_end() && m.frame_end().totals().samples_per_pixel() == 8; }));
    client.send(view(2, 0.1));
    ASSERT_TRUE(client.reader().wait_for_frame_end(2));
    text = scrape();
    EXPECT_EQ(first_tiles(text), 2);
    EXPECT_EQ(ages(text), 8);
    EXPECT_EQ(text.value("heliograph_first_tile_seconds_count", {{"picture", "preview"}}), 0);
  }
  // Nor is one that another stream is shown again.
  StreamClient again(stub(), session);
  ASSERT_TRUE(again.reader().wait_for_frame_end(2));
  const MetricsText text = scrape();
  EXPECT_EQ(first_tiles(text), 2);
  EXPECT_EQ(ages(text), 8);
  // And jobs have no view that anybody waits for.
  run_job(load_quad(), 64, 64, 2);
  EXPECT_EQ(first_tiles(scrape()), 2);
}

TEST_F(MetricsTest, TellHowOldPreviewsAre) {
  start_with_page();
  pb::CreateSessionRequest create_request;
  create_request.set_scene_id(load_scene());
  create_request.mutable_settings()->set_width(128);
  create_request.mutable_settings()->set_height(128);
  create_request.mutable_settings()->set_preview_rate(30);
  create_request.mutable_budget()->set_samples(1);
  pb::CreateSessionResponse created;
  ASSERT_TRUE(create(create_request, &created).ok());
  StreamClient client(stub(), created.session_id());
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for(
      [](const auto& m) { return m.has_frame_end() && m.frame_end().reason() == pb::END_REASON_SAMPLES; }));
  const MetricsText text = scrape();
  EXPECT_EQ(text.value("heliograph_first_tile_seconds_count", {{"picture", "preview"}}), 1);
  EXPECT_EQ(text.value("heliograph_picture_age_seconds_count", {{"picture", "preview"}}), 1);
  EXPECT_EQ(text.value("heliograph_first_tile_seconds_count", {{"picture", "film"}}), 1);
}

TEST_F(MetricsTest, TellMemoryByOwner) {
  start_with_page();
  const std::string scene = load_scene(), session = create_session(scene, 64, 64);
  const auto sum = [](const MetricsText& text) {
    const auto& samples = text.families().at("heliograph_memory_bytes").samples;
    return std::accumulate(samples.begin(), samples.end(), 0.0,
                           [](double bytes, const MetricSample& one) { return bytes + one.value; });
  };
  const auto bytes = [](const MetricsText& text, const char* owner) {
    return text.value("heliograph_memory_bytes", {{"owner", owner}});
  };
  const MetricsText held = scrape();
  EXPECT_EQ(bytes(held, "films"), 64 * 64 * (120 + 8)) << "server/README.md, Memory: mode pt, and invalid counts";
  EXPECT_GT(bytes(held, "scenes"), 0);
  EXPECT_EQ(bytes(held, "queues"), 0);
  EXPECT_EQ(bytes(held, "other"), 0);
  EXPECT_EQ(sum(held), bytes(held, "films") + bytes(held, "scenes"));
  EXPECT_EQ(held.value("heliograph_memory_limit_bytes"), double(1ull << 30));
  EXPECT_GE(held.value("heliograph_memory_peak_bytes"), sum(held));

  StreamClient client(stub(), session);
  client.send(view(1));
  ASSERT_TRUE(client.reader().wait_for_tiles(1));
  EXPECT_EQ(bytes(scrape(), "queues"), 64 * 64 * 32) << "two pictures of halves with variance and samples";
  pb::CloseSessionRequest close;
  pb::CloseSessionResponse closed;
  close.set_session_id(session);
  ASSERT_TRUE(call(&pb::RenderService::Stub::CloseSession, close, &closed).ok());
  EXPECT_TRUE(eventually([&] { return bytes(scrape(), "films") == 0 && bytes(scrape(), "queues") == 0; }));

  EXPECT_EQ(scrape().value("heliograph_memory_refusals_total"), 0);
  pb::CreateSessionRequest large;
  large.set_scene_id(scene);
  large.mutable_settings()->set_width(4096);
  large.mutable_settings()->set_height(4096);  // 2 GiB, twice the limit
  pb::CreateSessionResponse refused;
  expect_status(create(large, &refused), grpc::StatusCode::RESOURCE_EXHAUSTED, {"max_memory"});
  EXPECT_EQ(scrape().value("heliograph_memory_refusals_total"), 1);
}

TEST_F(MetricsTest, TellSessionsAndJobsByState) {
  start_with_page([](ServerConfig& config) { config.max_jobs = 1; });
  const std::string scene = load_scene();
  const std::string attached = create_session(scene, 16, 16), idle = create_session(scene, 16, 16);
  StreamClient client(stub(), attached);
  ASSERT_TRUE(client.reader().wait_for([](const auto& m) { return m.has_opened(); }));
  MetricsText text = scrape();
  EXPECT_EQ(text.value("heliograph_sessions", {{"state", "attached"}}), 1);
  EXPECT_EQ(text.value("heliograph_sessions", {{"state", "idle"}}), 1);
  EXPECT_EQ(text.value("heliograph_scenes"), 1);

  const auto jobs = [](const MetricsText& text, const char* kind, const char* state) {
    return text.value("heliograph_jobs", {{"kind", kind}, {"state", state}});
  };
  grpc::ClientContext context;
  pb::RunJobRequest endless;
  endless.set_scene_id(scene);
  endless.mutable_budget()->set_time_s(1000);
  auto reader = stub().RunJob(&context, endless);
  pb::RunJobResponse response;
  ASSERT_TRUE(reader->Read(&response));
  const std::string first = submitted(request(scene, 64, 1 << 20)), second = submitted(request(scene, 64, 4));
  text = scrape();
  EXPECT_EQ(jobs(text, "call", "running"), 1);
  EXPECT_EQ(jobs(text, "kept", "running"), 0);
  EXPECT_EQ(jobs(text, "kept", "queued"), 2);
  EXPECT_TRUE(pause(second).ok());
  text = scrape();
  EXPECT_EQ(jobs(text, "kept", "queued"), 1);
  EXPECT_EQ(jobs(text, "kept", "paused"), 1);

  context.TryCancel();  // its place is the first one's
  wait_for(first, pb::JOB_STATE_RUNNING);
  text = scrape();
  EXPECT_EQ(jobs(text, "call", "running"), 0);
  EXPECT_EQ(jobs(text, "kept", "running"), 1);
  EXPECT_TRUE(cancel(first).ok());
  EXPECT_TRUE(cancel(second).ok());
  wait_for(first, pb::JOB_STATE_CANCELED);
  text = scrape();
  EXPECT_EQ(jobs(text, "kept", "canceled"), 2);
  EXPECT_TRUE(eventually([&] { return scrape().value("heliograph_jobs_ended_total", {{"state", "canceled"}}) == 2; }));
}

TEST_F(MetricsTest, TellWhatCheckpointsTake) {
  start_with_page([](ServerConfig& config) { config.checkpoint_interval_s = 0.01; });
  const std::string id = submitted(request(load_scene(), 64, 1 << 20));
  EXPECT_TRUE(eventually([&] { return scrape().value("heliograph_checkpoint_write_seconds_count") >= 2; }));
  const MetricsText text = scrape();
  EXPECT_GE(text.value("heliograph_checkpoint_seconds_count"), 2);
  EXPECT_GT(text.value("heliograph_checkpoint_seconds_sum"), 0);
  EXPECT_EQ(text.value("heliograph_checkpoint_failures_total"), 0);
  EXPECT_TRUE(cancel(id).ok());
  wait_for(id, pb::JOB_STATE_CANCELED);
}

TEST_F(MetricsTest, CountCallsByMethodAndCode) {
  start_with_page();
  const auto calls = [&](const char* method, const char* code) {
    return scrape().value("heliograph_rpc_total", {{"method", method}, {"code", code}});
  };
  pb::GetServerInfoResponse info;
  for (int i = 0; i < 3; ++i)
    ASSERT_TRUE(call(&pb::RenderService::Stub::GetServerInfo, pb::GetServerInfoRequest(), &info).ok());
  EXPECT_TRUE(eventually([&] { return calls("GetServerInfo", "OK") == 3; }));
  StreamClient stream(stub(), "no-such-session");
  EXPECT_EQ(stream.status().error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_TRUE(eventually([&] { return calls("StreamFrames", "NOT_FOUND") == 1; }));
  EXPECT_EQ(calls("StreamFrames", "OK"), 0);
  grpc::ClientContext context;
  pb::RunJobRequest endless;
  endless.set_scene_id(load_quad());
  endless.mutable_budget()->set_time_s(1000);
  auto reader = stub().RunJob(&context, endless);
  pb::RunJobResponse response;
  ASSERT_TRUE(reader->Read(&response));
  context.TryCancel();
  EXPECT_TRUE(eventually([&] { return calls("RunJob", "CANCELLED") == 1; }));
  EXPECT_EQ(calls("RunJob", "OK"), 0);
  // The page's calls come without a socket.
  (void)send_raw(server_->in_process_channel(), kRenderService + "ListScenes", {""});
  EXPECT_TRUE(eventually([&] { return calls("ListScenes", "OK") == 1; }));
  (void)send_raw(new_channel(), "/grpc.health.v1.Health/Check", {""});
  EXPECT_TRUE(eventually([&] { return calls("Check", "OK") == 1; }));
}

TEST(RpcCounts, HaveABound) {
  RpcCounts counts({"B", "A"});
  EXPECT_EQ(counts.methods(), 3u);
  EXPECT_EQ(counts.name(counts.method_of("/some.Service/A")), "A");
  EXPECT_EQ(counts.name(counts.method_of("/some.Service/B")), "B");
  for (const char* path : {"/some.Service/C", "", "/", "other"})
    EXPECT_EQ(counts.name(counts.method_of(path)), "other") << path;
  counts.count(0, 8);
  EXPECT_EQ(counts.value(0, 8), 1u);
  EXPECT_STREQ(RpcCounts::code_name(8), "RESOURCE_EXHAUSTED");
  EXPECT_STREQ(RpcCounts::code_name(16), "UNAUTHENTICATED");
  for (const int code : {-1, 17, 1 << 30}) counts.count(0, code);
  EXPECT_EQ(counts.value(0, 2), 3u) << "UNKNOWN";
}

TEST(Histogram, CountsWhatLiesAtOrBelowItsBounds) {
  Histogram histogram{1, 2, 5};
  for (const double value : {0.5, 1.0, 1.5, 5.0, 6.0, std::nan("")}) histogram.observe(value);
  EXPECT_EQ(histogram.count(0), 2u);
  EXPECT_EQ(histogram.count(1), 1u);
  EXPECT_EQ(histogram.count(2), 1u);
  EXPECT_EQ(histogram.count(3), 2u) << "above all, and what is no number";
}

// ---- Who may read them ---------------------------------------------------------------------------------------------

TEST(WebAccess, JudgesWhoAsksForMetrics) {
  using Verdict = WebAccess::Verdict;
  const WebAccess access({"render.example"});
  const AccessTokens none{}, some = AccessTokens::of(kToken);
  const std::string good = "Bearer " + kToken;
  struct Case {
    bool local;
    const char* host;
    std::string authorization;
    Verdict without_tokens, with_tokens;
  };
  const Case cases[] = {
      {true, "localhost:7780", "", Verdict::allowed, Verdict::allowed},
      {true, "render.example", "", Verdict::allowed, Verdict::allowed},
      {true, "evil.example", "", Verdict::unknown_host, Verdict::unknown_host},
      {true, "", "", Verdict::unknown_host, Verdict::unknown_host},
      {false, "localhost", "", Verdict::not_local, Verdict::unknown_token},
      {false, "10.0.0.7:7780", good, Verdict::not_local, Verdict::allowed},
      {true, "evil.example", good, Verdict::unknown_host, Verdict::allowed},
      {true, "localhost", "Bearer 0123456789abcdeg", Verdict::allowed, Verdict::unknown_token},
      {false, "localhost", kToken, Verdict::not_local, Verdict::unknown_token},  // without "Bearer"
  };
  for (const Case& one : cases) {
    const WebAccess::Scraper scraper{one.local, one.host, one.authorization};
    EXPECT_EQ(access.judge_scraper(scraper, none), one.without_tokens) << one.host << one.authorization;
    EXPECT_EQ(access.judge_scraper(scraper, some), one.with_tokens) << one.host << one.authorization;
  }
}

TEST_F(MetricsTest, AreForThisMachineOrATokensHolder) {
  for (const bool tokens : {false, true}) {
    start_with_page([&](ServerConfig& config) {
      if (tokens) config.token = kToken;
      config.state.clear();
    });
    const auto get = [&](const std::map<std::string, std::string>& headers) {
      return WebPeer(server_->http_address()).get("/metrics", headers);
    };
    EXPECT_EQ(get({}).status, 200);
    EXPECT_EQ(get({{"Host", "evil.example"}}).status, 403);
    // A proxy on this machine passes on what comes from elsewhere.
    for (const char* header : {"X-Forwarded-For", "Forwarded", "X-Real-IP", "Via"}) {
      const HttpAnswer passed_on = get({{header, "10.0.0.7"}});
      EXPECT_EQ(passed_on.status, tokens ? 401 : 403) << header;
      EXPECT_NE(passed_on.body.find(tokens ? "Authorization: Bearer" : "--token-file"), std::string::npos);
    }
    const std::string good = "Bearer " + kToken;
    EXPECT_EQ(get({{"Via", "a proxy"}, {"Host", "render:80"}, {"Authorization", good}}).status, tokens ? 200 : 403);
    EXPECT_EQ(get({{"Authorization", "Bearer another-token-of-16"}}).status, tokens ? 401 : 200);
    const HttpAnswer head = WebPeer(server_->http_address()).get("/metrics", {}, "HEAD");
    EXPECT_EQ(head.status, 200);
    EXPECT_GT(std::stoi(head.headers.at("content-length")), 1000);
    TearDown();
  }
}

TEST_F(MetricsTest, ManyMayAskAtOnce) {
  start_with_page();
  std::vector<std::unique_ptr<WebPeer>> peers;
  for (int i = 0; i < 20; ++i) {
    peers.push_back(std::make_unique<WebPeer>(server_->http_address()));
    ASSERT_TRUE(peers.back()->send("GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n"));
  }
  int answered = 0;
  for (const auto& peer : peers) {
    const HttpAnswer answer = peer->read_answer();
    EXPECT_TRUE(answer.status == 200 || answer.status == 503) << answer.status;
    answered += answer.status == 200;
  }
  EXPECT_GT(answered, 0);
  // Whoever has gone meanwhile is not waited for, nor is the daemon's end held up.
  for (int i = 0; i < 20; ++i)
    WebPeer(server_->http_address()).send("GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_TRUE(server_->drain(1));
}

// ---- Health --------------------------------------------------------------------------------------------------------

// grpc.health.v1 by hand: request { string service = 1 }, response { status = 1 }.
std::string health_request(const std::string& service) {
  return service.empty() ? std::string() : "\x0A" + std::string(1, char(service.size())) + service;
}
const std::string kServing = "\x08\x01", kNotServing = "\x08\x02";

TEST_F(MetricsTest, HealthHasAServiceForKeptJobs) {
  const auto health = [&](const std::string& service) {
    return send_raw(new_channel(), "/grpc.health.v1.Health/Check", {health_request(service)});
  };
  start_with_page();
  for (const char* service : {"", "heliograph.v1.RenderService", "heliograph.v1.jobs"})
    EXPECT_EQ(health(service).messages, std::vector{kServing}) << service;
  EXPECT_EQ(health("heliograph.v1.other").status.error_code(), grpc::StatusCode::NOT_FOUND);
  TearDown();
  start_with_page([](ServerConfig& config) { config.state.clear(); });
  EXPECT_EQ(health("heliograph.v1.RenderService").messages, std::vector{kServing});
  EXPECT_EQ(health("heliograph.v1.jobs").messages, std::vector{kNotServing});
}

// Another program holds the table's lock for longer than the daemon waits.
TEST_F(MetricsTest, HealthOfKeptJobsFollowsTheStateFolder) {
  start_with_page();
  const auto health = [&] {
    return send_raw(new_channel(), "/grpc.health.v1.Health/Check", {health_request("heliograph.v1.jobs")}).messages;
  };
  const std::string scene = load_scene();
  auto other = SqliteDatabase::open(folder_ / "state/jobs.sqlite", SqliteDatabase::Access::write);
  ASSERT_TRUE(other.ok()) << other.error().to_string();
  ASSERT_TRUE((*other)->execute("BEGIN IMMEDIATE").ok());
  pb::SubmitJobResponse response;
  expect_status(submit(request(scene, 16, 2), &response), grpc::StatusCode::UNAVAILABLE, {"jobs.sqlite"});
  EXPECT_EQ(health(), std::vector{kNotServing});
  EXPECT_EQ(scrape().value("heliograph_state_writable"), 0);
  ASSERT_TRUE((*other)->execute("ROLLBACK").ok());
  EXPECT_TRUE(eventually([&] { return health() == std::vector{kServing}; }));
  EXPECT_EQ(scrape().value("heliograph_state_writable"), 1);
  EXPECT_EQ(wait_for(submitted(request(scene, 16, 2)), pb::JOB_STATE_SUCCEEDED).state(), pb::JOB_STATE_SUCCEEDED);
}

TEST_F(MetricsTest, ADrainIsSeenFromOutside) {
  start_with_page();
  EXPECT_EQ(WebPeer(server_->http_address()).get("/readyz").status, 200);
  EXPECT_EQ(scrape().value("heliograph_draining"), 0);
  grpc::ClientContext context;
  pb::RunJobRequest endless;
  endless.set_scene_id(load_quad());
  endless.mutable_budget()->set_time_s(1000);
  auto reader = stub().RunJob(&context, endless);
  pb::RunJobResponse response;
  ASSERT_TRUE(reader->Read(&response));
  std::thread drain([&] { server_->drain(600); });
  EXPECT_TRUE(eventually([&] { return WebPeer(server_->http_address()).get("/readyz").status == 503; }));
  const HttpAnswer ready = WebPeer(server_->http_address()).get("/readyz");
  EXPECT_EQ(ready.body, "the daemon is draining\n");
  EXPECT_EQ(WebPeer(server_->http_address()).get("/healthz").status, 200);
  EXPECT_EQ(scrape().value("heliograph_draining"), 1);
  for (const char* service : {"", "heliograph.v1.RenderService", "heliograph.v1.jobs"}) {
    const RawAnswer answer = send_raw(new_channel(), "/grpc.health.v1.Health/Check", {health_request(service)});
    EXPECT_EQ(answer.messages, std::vector{kNotServing}) << service;
  }
  context.TryCancel();
  drain.join();
}

}  // namespace
}  // namespace helio::test
