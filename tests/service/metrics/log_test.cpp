// The daemon's log: each line whole, and in the format json an object of JSON, whatever names and errors hold.
#include "server/base/log_format.h"

#include <signal.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "process.h"
#include "service_fixture.h"

namespace helio::test {
namespace {

using nlohmann::json;

// 2026-11-26T20:36:14.824Z: 1,795,725,374 s after 1970 by `date -u -d 2026-11-26T20:36:14 +%s`.
const std::chrono::system_clock::time_point kTime{std::chrono::milliseconds(1795725374824)};
const std::string kTimeText = "2026-11-26T20:36:14.824Z";

json as_json(const std::string& payload) {
  const std::string line = json_line(payload, "info", kTime);
  EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  return json::parse(line);  // throws where it is none, or no UTF-8
}

TEST(LogFormat, FieldsAreThoseAtTheEndOfALine) {
  const json line =
      as_json(R"(session created session=s-79 size=64x64 build_s=0.029 views=3 ok=true error="a \"b\"")");
  EXPECT_EQ(line, (json{{"time", kTimeText},
                        {"level", "info"},
                        {"message", "session created"},
                        {"session", "s-79"},
                        {"size", "64x64"},
                        {"build_s", 0.029},
                        {"views", 3},
                        {"ok", true},
                        {"error", "a \"b\""}}));
  EXPECT_EQ(text_line("drained seconds=1.5", "info", kTime), kTimeText + " info drained seconds=1.5");
}

TEST(LogFormat, IdsAreNoNumbers) {
  const json line = as_json("x session=12 job=1e5 scene=000123456789 bytes=12");
  EXPECT_EQ(line["session"], "12");
  EXPECT_EQ(line["job"], "1e5");
  EXPECT_EQ(line["scene"], "000123456789");
  EXPECT_EQ(line["bytes"], 12);
  // What JSON has no number for.
  for (const char* value : {"inf", "nan", "01", "1.", ".5", "+1", "0x10", "1e999", "123456789012345678"})
    EXPECT_EQ(as_json(std::string("x bytes=") + value)["bytes"], value);
}

TEST(LogFormat, WhatKeepsToNoRuleIsTheMessage) {
  for (const std::string& text :
       {std::string("grpc: a=b c"), std::string(""), std::string("  "), std::string("a ="), std::string("x=\"open"),
        std::string("x=\"bad \\q\""), std::string("Name=upper"), std::string("a=b=c"), std::string("x=\"a\"b")}) {
    const json line = as_json(text);
    EXPECT_EQ(line.size(), 3u) << text << " " << line;
    EXPECT_EQ(line["message"], text.find_first_not_of(' ') == std::string::npos ? "" : text);
  }
  // Names that every line has, and names that come twice, are not given away.
  EXPECT_EQ(as_json("a level=loud b=1")["message"], "a level=loud");
  EXPECT_EQ(as_json("a b=1 b=2")["message"], "a b=1");
  EXPECT_EQ(as_json("a b=1 b=2")["b"], 2);
}

// Every byte alone, every pair with what begins a sequence, and the ends of UTF-8's ranges.
TEST(LogFormat, AnyBytesMakeOneLineOfJson) {
  std::vector<std::string> texts = {"\xc3\xa9", "\xe2\x82\xac", "\xf0\x9f\x98\x80", "\xc0\x80",     "\xed\xa0\x80",
                                    "\xf4\x90\x80\x80", "\xe2\x82", "\xf0\x9f\x98", "a\"b\\c", "\xef\xbf\xbd"};
  for (int a = 0; a < 256; ++a) {
    texts.push_back(std::string(1, char(a)));
    texts.push_back("x" + std::string(1, char(a)) + " y=z");
    for (const unsigned char b : {0xc3, 0xe2, 0xf0, 0x80, 0x22, 0x5c}) texts.push_back({char(b), char(a)});
  }
  for (const std::string& text : texts) {
    (void)as_json(text);
    (void)as_json("loaded file=" + text + " b=1");
    const json line = as_json("loaded file=" + logged(text) + " b=1");
    EXPECT_EQ(line["message"], "loaded");
    ASSERT_TRUE(line.contains("file")) << logged(text);
    EXPECT_EQ(line["b"], 1);
    const std::string plain = text_line("loaded file=" + logged(text), "info", kTime);
    EXPECT_TRUE(std::none_of(plain.begin(), plain.end(), [](unsigned char c) { return c < ' ' || c == 127; }));
    const std::string raw = text_line(text, "info", kTime);
    EXPECT_TRUE(std::none_of(raw.begin(), raw.end(), [](unsigned char c) { return c < ' ' || c == 127; }));
  }
  EXPECT_EQ(as_json("x file=" + logged("a\xff\n"))["file"], "a\\xff\n");
  EXPECT_EQ(as_json("x file=" + logged("caf\xc3\xa9"))["file"], "caf\xc3\xa9");
  EXPECT_EQ(logged("caf\xc3\xa9"), "caf\xc3\xa9");
  EXPECT_EQ(logged(""), "\"\"");
  EXPECT_EQ(logged("two words"), "\"two words\"");
  EXPECT_EQ(text_line("a\nb\x1b[31m\xff", "info", kTime), kTimeText + " info a\\nb\\u001b[31m\\xff");
}

// ---- The log of a process ------------------------------------------------------------------------------------------

class LogTest : public ServiceTest {
 protected:
  void start_process(const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"--state", folder_ / "state", "--scene-root", folder_.path(),
                                          "--render-threads", "2", "--max-memory", "256M"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    process_ = std::make_unique<Process>(HELIO_DAEMON, arguments, folder_.path());
    ASSERT_TRUE(process_->wait_for_output("listening on "));
    ASSERT_TRUE(process_->wait_for_output("\n"));
    const std::string said = process_->output();
    std::string address = said.substr(said.find("listening on ") + 13);
    address = address.substr(0, address.find('\n'));
    channel_ = grpc::CreateChannel(address, grpc::InsecureChannelCredentials());
    stub_ = pb::RenderService::NewStub(channel_);
  }
  // Loads, refusals, a session, a job, and names that no log would choose.
  void work() {
    const std::string scene = load_quad();
    for (const std::string& name :
         {std::string("a\nb \"c\".gltf"), std::string("\x1b[31m\xc3\xa9.gltf"), std::string("session=s-1 level=9")}) {
      Upload upload;
      upload.name = name;
      upload.bytes = "no glTF\n{\"level\": \"forged\"}\n";
      pb::LoadSceneResponse response;
      EXPECT_FALSE(load(upload.messages(), &response).ok()) << name;
    }
    pb::CreateSessionRequest large;
    large.set_scene_id(scene);
    large.mutable_settings()->set_width(4096);
    large.mutable_settings()->set_height(4096);
    pb::CreateSessionResponse created;
    EXPECT_FALSE(create(large, &created).ok());
    session_ = create_session(scene, 16, 16, 2);
    {
      StreamClient client(stub(), session_);
      client.send(view(1));
      EXPECT_TRUE(client.reader().wait_for_frame_end(1));
      pb::StreamRequest close;
      close.mutable_close()->set_close_session(true);
      client.send(close);
      EXPECT_TRUE(client.status().ok());
    }
    pb::SubmitJobRequest job;
    job.set_name("\"quoted\\name\" job=j-0");
    job.mutable_job()->set_scene_id(scene);
    job.mutable_job()->mutable_settings()->set_width(16);
    job.mutable_job()->mutable_settings()->set_height(16);
    job.mutable_job()->mutable_budget()->set_samples(2);
    pb::SubmitJobResponse submitted;
    EXPECT_TRUE(call(&pb::RenderService::Stub::SubmitJob, job, &submitted).ok());
    job_ = submitted.job().job_id();
    EXPECT_TRUE(process_->wait_for_errors("job succeeded"));
  }
  std::vector<std::string> lines() {
    std::vector<std::string> lines;
    std::istringstream text(process_->errors());
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    return lines;
  }
  void stop() {
    process_->send_signal(SIGTERM);
    EXPECT_EQ(process_->wait().exit_code, 0);
  }

  TemporaryFolder folder_;
  std::unique_ptr<Process> process_;
  std::shared_ptr<grpc::Channel> channel_;
  std::string session_, job_;
};

TEST_F(LogTest, OfJsonHasAnObjectALine) {
  start_process({"--log-format", "json", "--log-level", "debug"});
  work();
  stop();
  std::map<std::string, json> newest;  // by message
  for (const std::string& line : lines()) {
    const json object = json::parse(line, nullptr, false);
    ASSERT_TRUE(object.is_object()) << line;
    ASSERT_TRUE(std::regex_match(object.value("time", ""),
                                 std::regex(R"(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z)")))
        << line;
    ASSERT_TRUE(object["level"].is_string() && object["message"].is_string()) << line;
    EXPECT_NE(object["level"], "forged");
    newest[object["message"]] = object;
  }
  for (const char* message :
       {"serving", "jobs are kept", "scene loaded", "scene refused", "memory refused", "session created",
        "session closed", "job submitted", "job begun", "job succeeded", "draining", "drained"}) {
    EXPECT_TRUE(newest.contains(message)) << message;
  }
  EXPECT_EQ(newest["session created"]["session"], session_);
  EXPECT_EQ(newest["session closed"]["session"], session_);
  EXPECT_EQ(newest["session created"]["peer"].get<std::string>().substr(0, 15), "ipv4:127.0.0.1:");
  EXPECT_EQ(newest["job submitted"]["name"], "\"quoted\\name\" job=j-0");
  for (const char* message : {"job submitted", "job begun", "job succeeded"})
    EXPECT_EQ(newest[message]["job"], job_) << message;
  EXPECT_TRUE(newest["job succeeded"]["seconds"].is_number());
  EXPECT_EQ(newest["scene refused"]["file"], "session=s-1 level=9");
  EXPECT_FALSE(newest["scene refused"].contains("session"));
  EXPECT_TRUE(newest["scene loaded"]["load_s"].is_number());
  EXPECT_EQ(newest["draining"]["signal"], "SIGTERM");
}

TEST_F(LogTest, OfTextHasALineForEachEvent) {
  start_process({});
  work();
  stop();
  const std::regex line_of_log(R"(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z (info|warning) .+)");
  for (const std::string& line : lines()) EXPECT_TRUE(std::regex_match(line, line_of_log)) << line;
  EXPECT_NE(process_->errors().find(" info session created session=" + session_ + " scene="), std::string::npos);
}

TEST_F(LogTest, OfJsonTellsWhyTheDaemonCannotServe) {
  const ProcessResult result =
      run_program(HELIO_DAEMON, {"--state", "none", "--log-format", "json", "--scene-root", folder_ / "no \"such\"\n"},
                  folder_.path());
  EXPECT_EQ(result.exit_code, 2);
  const json line = json::parse(result.err, nullptr, false);
  ASSERT_TRUE(line.is_object()) << result.err;
  EXPECT_EQ(line["message"], "the daemon cannot serve");
  EXPECT_NE(line["error"].get<std::string>().find("no \"such\"\n"), std::string::npos);
}

}  // namespace
}  // namespace helio::test
