// Tokens and what their roles allow: by rpc, by what belongs to whom, and when the file is changed.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <map>
#include <set>

#include "security/token_fixture.h"
#include "server/base/access_control.h"
#include "server/rpc/call_rights.h"

namespace helio::test {
namespace {

using grpc::StatusCode;
using Stub = pb::RenderService::Stub;

constexpr std::uint32_t kNoEnd = 1u << 30;  // samples

class Roles : public TokenTest {
 protected:
  void SetUp() override {
    add_token("viewer", Role::view);
    add_token("alice", Role::render);
    add_token("bob", Role::render);
    add_token("root", Role::admin);
  }
  void start_keeping_jobs() {
    start_with_tokens([&](ServerConfig& config) { config.state = in("state"); });
  }
  grpc::Status submit_as(const std::string& name, const std::string& scene_id, const std::string& client_token,
                         pb::Job* job) {
    pb::SubmitJobRequest request;
    request.set_client_token(client_token);
    request.mutable_job()->set_scene_id(scene_id);
    request.mutable_job()->mutable_settings()->set_width(16);
    request.mutable_job()->mutable_settings()->set_height(16);
    request.mutable_job()->mutable_budget()->set_samples(kNoEnd);
    pb::SubmitJobResponse response;
    const grpc::Status status = call_as(name, &Stub::SubmitJob, request, &response);
    *job = response.job();
    return status;
  }
};

TEST(CallRights, HaveARowForEveryRpcOfTheService) {
  std::set<std::string> rpcs, rows;
  const auto* descriptor =
      google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(pb::RenderService::service_full_name());
  ASSERT_NE(descriptor, nullptr);
  for (int i = 0; i < descriptor->method_count(); ++i) rpcs.insert(descriptor->method(i)->name());
  for (const CallRight& right : call_rights()) {
    EXPECT_TRUE(rows.insert(std::string(right.rpc)).second) << right.rpc << " twice";
    EXPECT_TRUE(right.acts_on == Belonging::none || right.least == Role::render) << right.rpc;
  }
  EXPECT_EQ(rows, rpcs);
  EXPECT_FALSE(check_role({"new", Role::render, {}, {}}, "RpcOfTomorrow").ok()) << "what nobody thought of";
}

TEST_F(Roles, DecideWhatEachRpcAnswers) {
  start_with_tokens([&](ServerConfig& config) { config.scene_roots = {folder_.path()}; });
  for (const CallRight& right : call_rights()) {
    const std::string rpc(right.rpc);
    EXPECT_EQ(touch(new_channel(), rpc, "", "").error_code(), StatusCode::UNAUTHENTICATED) << rpc;
    EXPECT_EQ(touch(new_channel(), rpc, "", std::string(32, '0')).error_code(), StatusCode::UNAUTHENTICATED) << rpc;
    for (const std::string name : {"viewer", "alice", "root"}) {
      const Role role = name == "viewer" ? Role::view : name == "alice" ? Role::render : Role::admin;
      const grpc::Status status = touch(new_channel(), rpc, "", token(name));
      if (role < right.least) {
        expect_status(
            status, StatusCode::PERMISSION_DENIED,
            {"'" + name + "'", std::string("role ") + to_string(role), rpc + " needs " + to_string(right.least)});
      } else {
        EXPECT_NE(status.error_code(), StatusCode::PERMISSION_DENIED) << rpc << " as " << name;
        EXPECT_NE(status.error_code(), StatusCode::UNAUTHENTICATED) << rpc << " as " << name;
      }
    }
  }
}

// A message of the rpc that names this thing, wherever its field lies.
std::string message_about(const std::string& rpc, const std::string& field, const std::string& id) {
  const auto* method = google::protobuf::DescriptorPool::generated_pool()
                           ->FindServiceByName(pb::RenderService::service_full_name())
                           ->FindMethodByName(rpc);
  google::protobuf::Message* message =
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(method->input_type())->New();
  const std::unique_ptr<google::protobuf::Message> owned(message);
  google::protobuf::Message* at = message;
  if (rpc == "StreamFrames")
    at = message->GetReflection()->MutableMessage(message, method->input_type()->FindFieldByName("open"));
  const auto* named = at->GetDescriptor()->FindFieldByName(field);
  EXPECT_NE(named, nullptr) << rpc;
  at->GetReflection()->SetString(at, named, id);
  return message->SerializeAsString();
}

TEST_F(Roles, WhatBelongsToAnotherTokenWantsAdmin) {
  start_keeping_jobs();
  const std::string scene = load_as("alice");
  std::map<Belonging, std::pair<std::string, std::string>> things = {{Belonging::scene, {"scene_id", scene}}};
  std::string session;
  ASSERT_TRUE(create_as("alice", scene, 16, &session).ok());
  things[Belonging::session] = {"session_id", session};
  pb::Job job;
  ASSERT_TRUE(submit_as("alice", scene, "", &job).ok());
  EXPECT_EQ(job.owner(), "alice");
  things[Belonging::job] = {"job_id", job.job_id()};
  int acted = 0;
  for (const CallRight& right : call_rights()) {
    if (right.acts_on == Belonging::none) continue;
    ++acted;
    const auto& [field, id] = things.at(right.acts_on);
    const std::string rpc(right.rpc);
    expect_status(touch(new_channel(), rpc, message_about(rpc, field, id), token("bob")), StatusCode::PERMISSION_DENIED,
                  {"belongs to the token 'alice'", "'bob'", "role render", "needs admin"});
  }
  EXPECT_EQ(acted, 8);
  // They may look; and all of it is there still.
  pb::ListSessionsResponse sessions;
  ASSERT_TRUE(call_as("viewer", &Stub::ListSessions, pb::ListSessionsRequest(), &sessions).ok());
  ASSERT_EQ(sessions.sessions_size(), 1);
  EXPECT_EQ(sessions.sessions(0).owner(), "alice");

  // An admin may act, and the events say who it was.
  EXPECT_TRUE(
      touch(new_channel(), "CancelJob", message_about("CancelJob", "job_id", job.job_id()), token("root")).ok());
  grpc::ClientContext context;
  name_token(context, "viewer");
  pb::WatchJobRequest watch;
  watch.set_job_id(job.job_id());
  watch.set_from_seq(1);
  auto reader = stub().WatchJob(&context, watch);
  std::set<std::string> by;
  pb::WatchJobResponse told;
  while (reader->Read(&told)) {
    const std::string& who = told.event().by();
    if (!who.empty()) by.insert(who.substr(0, who.find(" (ipv4:127.0.0.1:")));
  }
  EXPECT_EQ(by, (std::set<std::string>{"alice", "root"}));
  EXPECT_TRUE(
      touch(new_channel(), "CloseSession", message_about("CloseSession", "session_id", session), token("alice")).ok())
      << "one's own";
}

TEST_F(Roles, AJobOfRunJobIsCancelledByItsOwnerAlone) {
  start_with_tokens();
  pb::RunJobRequest request;
  request.set_scene_id(load_as("alice"));
  request.mutable_settings()->set_width(16);
  request.mutable_settings()->set_height(16);
  request.mutable_budget()->set_samples(kNoEnd);
  grpc::ClientContext context;
  name_token(context, "alice");
  auto reader = stub().RunJob(&context, request);
  pb::RunJobResponse response;
  ASSERT_TRUE(reader->Read(&response));
  pb::CancelJobRequest cancel;
  cancel.set_job_id(response.accepted().job_id());
  pb::CancelJobResponse cancelled;
  expect_status(call_as("bob", &Stub::CancelJob, cancel, &cancelled), StatusCode::PERMISSION_DENIED, {"alice"});
  EXPECT_TRUE(call_as("alice", &Stub::CancelJob, cancel, &cancelled).ok());
  while (reader->Read(&response)) {
  }
  EXPECT_TRUE(reader->Finish().ok());
}

TEST_F(Roles, ASceneThatOthersLoadedTooStays) {
  start_with_tokens();
  pb::UnloadSceneRequest unload;
  pb::UnloadSceneResponse response;
  unload.set_scene_id(load_as("alice"));
  EXPECT_EQ(load_as("bob"), unload.scene_id()) << "the same scene";
  expect_status(call_as("alice", &Stub::UnloadScene, unload, &response), StatusCode::PERMISSION_DENIED, {"bob"});
  EXPECT_TRUE(call_as("root", &Stub::UnloadScene, unload, &response).ok());
  load_as("alice");
  EXPECT_TRUE(call_as("alice", &Stub::UnloadScene, unload, &response).ok());
}

TEST_F(Roles, ViewersWatchWithoutTakingASessionOver) {
  start_with_tokens();
  std::string session;
  ASSERT_TRUE(create_as("alice", load_as("alice"), 16, &session).ok());
  const auto watch = [&](const std::string& name, grpc::ClientContext& context) {
    name_token(context, name);
    pb::WatchFramesRequest request;
    request.set_session_id(session);
    return stub().WatchFrames(&context, request);
  };
  grpc::ClientContext first, second;
  auto watching = watch("viewer", first);
  pb::StreamResponse response;
  ASSERT_TRUE(watching->Read(&response)) << "nobody listens to it";
  EXPECT_TRUE(response.has_opened());
  TokenStream owner(stub(), token("alice"), session);
  ASSERT_TRUE(owner.opened());
  while (watching->Read(&response)) {
  }
  EXPECT_EQ(watching->Finish().error_code(), StatusCode::ABORTED) << "the owner takes over";
  auto refused = watch("viewer", second);
  EXPECT_FALSE(refused->Read(&response));
  expect_status(refused->Finish(), StatusCode::PERMISSION_DENIED, {"has a listener", "needs admin"});
}

TEST_F(Roles, ClientTokensAreEachOwnersOwn) {
  start_keeping_jobs();
  const std::string scene = load_as("alice");
  pb::Job alice, again, bob;
  ASSERT_TRUE(submit_as("alice", scene, "one", &alice).ok());
  ASSERT_TRUE(submit_as("alice", scene, "one", &again).ok());
  ASSERT_TRUE(submit_as("bob", scene, "one", &bob).ok());
  EXPECT_EQ(again.job_id(), alice.job_id());
  EXPECT_NE(bob.job_id(), alice.job_id());
}

// Between a call's admission and its beginning the file may be read again.
TEST(AccessControl, ACallWhoseTokenWentWhileItBeganEndsAtOnce) {
  const TemporaryFolder folder;
  const std::string file = folder / "tokens";
  const auto line = [](const std::string& name, Role role) {
    return to_token_line({name, role, {}, AccessTokens::digest_of(name + "-and-sixteen-characters")}) + "\n";
  };
  write_file(file, line("alice", Role::render) + line("bob", Role::render) + line("carol", Role::render));
  AccessControl access(*AccessTokens::read(file), file);
  std::map<std::string, CallerPtr> callers;
  for (const char* name : {"alice", "bob", "carol"}) callers[name] = access.tokens()->by_name(name);
  write_file(file, line("alice", Role::admin) + line("carol", Role::view));
  ASSERT_TRUE(access.reload().ok());
  const auto ended = [&](const std::string& name) {
    int ends = 0;
    const auto call = access.begin(callers.at(name), [&](const grpc::Status& status) {
      EXPECT_EQ(status.error_code(), StatusCode::UNAUTHENTICATED);
      ++ends;
    });
    EXPECT_NE(call, nullptr);
    return ends;
  };
  EXPECT_EQ(ended("alice"), 0) << "may do more";
  EXPECT_EQ(ended("bob"), 1);
  EXPECT_EQ(ended("carol"), 1) << "may do less";
}

TEST_F(Roles, AFileThatIsReadAgainEndsTheCallsOfATokenThatIsGone) {
  start_keeping_jobs();
  spdlog::set_level(spdlog::level::off);
  const std::string scene = load_as("alice");
  std::string of_alice, of_bob;
  ASSERT_TRUE(create_as("alice", scene, 16, &of_alice).ok());
  ASSERT_TRUE(create_as("bob", scene, 16, &of_bob).ok());
  TokenStream alice(stub(), token("alice"), of_alice), bob(stub(), token("bob"), of_bob);
  ASSERT_TRUE(alice.opened() && bob.opened());
  grpc::ClientContext context;
  name_token(context, "bob");
  auto watch = stub().WatchJob(&context, pb::WatchJobRequest());
  pb::WatchJobResponse told;
  ASSERT_TRUE(watch->Read(&told));

  write_file(in("tokens"), "alice painter sha256:00\n");
  server_->reload();
  pb::GetServerInfoResponse info;
  EXPECT_TRUE(call_as("bob", &Stub::GetServerInfo, pb::GetServerInfoRequest(), &info).ok())
      << "a bad file changes nothing";

  const auto line = [&](const std::string& name, Role role) {
    return to_token_line({name, role, {}, AccessTokens::digest_of(token(name))}) + "\n";
  };
  write_file(in("tokens"), line("alice", Role::render) + line("root", Role::view));
  server_->reload();
  EXPECT_EQ(bob.status().error_code(), StatusCode::UNAUTHENTICATED);
  while (watch->Read(&told)) {
  }
  expect_status(watch->Finish(), StatusCode::UNAUTHENTICATED, {"token"});
  EXPECT_EQ(call_as("bob", &Stub::GetServerInfo, pb::GetServerInfoRequest(), &info).error_code(),
            StatusCode::UNAUTHENTICATED);
  EXPECT_TRUE(call_as("alice", &Stub::GetServerInfo, pb::GetServerInfoRequest(), &info).ok());
  pb::CloseSessionRequest close;
  close.set_session_id(of_alice);
  pb::CloseSessionResponse closed;
  EXPECT_EQ(call_as("root", &Stub::CloseSession, close, &closed).error_code(), StatusCode::PERMISSION_DENIED)
      << "a role that was taken away";
  EXPECT_TRUE(call_as("alice", &Stub::CloseSession, close, &closed).ok());
  EXPECT_TRUE(alice.status().ok()) << "hers went on until she closed it";
}

TEST_F(Roles, AnOldFileOfTokensAloneGivesEveryRight) {
  write_file(in("tokens"), "# two of us\n0123456789abcdef\nfedcba9876543210\n");
  start([&](ServerConfig& config) { config.token_file = in("tokens"); });
  grpc::ClientContext context;
  context.AddMetadata("authorization", "Bearer fedcba9876543210");
  pb::ListSessionsResponse sessions;
  EXPECT_TRUE(stub().ListSessions(&context, pb::ListSessionsRequest(), &sessions).ok());
  const auto tokens = AccessTokens::read(in("tokens"));
  ASSERT_TRUE(tokens.ok());
  // Not by their lines, which change when others come and go.
  EXPECT_EQ(tokens->find("0123456789abcdef")->name, "unnamed-9f9f5111f7b2");
  EXPECT_EQ(tokens->find("fedcba9876543210")->role, Role::admin);
}

// Neither would end, nor a pipe without a writer begin.
TEST_F(Roles, AFileOfTokensIsAFile) {
  ASSERT_EQ(mkfifo(in("pipe").c_str(), 0600), 0);
  for (const std::string& file : {in("pipe"), std::string("/dev/zero"), in("none")}) {
    const auto read = AccessTokens::read(file);
    ASSERT_FALSE(read.ok()) << file;
    EXPECT_NE(read.error().to_string().find(file), std::string::npos) << read.error().to_string();
  }
}

TEST_F(Roles, TheCaseOfTheSchemeDoesNotCount) {
  const AccessTokens tokens = AccessTokens::of("0123456789abcdef");
  EXPECT_TRUE(tokens.find_header("bearer 0123456789abcdef"));
  EXPECT_TRUE(tokens.find_header("BEARER 0123456789abcdef"));
  EXPECT_FALSE(tokens.find_header("Bearer 0123456789ABCDEF"));
  EXPECT_FALSE(tokens.find_header("Basic 0123456789abcdef"));
  EXPECT_FALSE(tokens.find_header("Bea"));
}

TEST_F(Roles, WrongLinesAreNamedAndShowNoToken) {
  const std::string hash = "sha256:" + to_hex(AccessTokens::digest_of("0123456789abcdef"));
  const auto problem = [&](const std::string& text) {
    write_file(in("tokens"), text);
    const auto read = AccessTokens::read(in("tokens"));
    EXPECT_FALSE(read.ok()) << text;
    return read.ok() ? std::string() : read.error().to_string();
  };
  struct Case {
    std::string text, part;
  };
  const Case cases[] = {{"\nalice painter " + hash, "line 2"},
                        {"alice painter " + hash, "allowed: view, render, admin"},
                        {"alice render sha256:12", "64 hexadecimal digits"},
                        {"alice render md5:12", "64 hexadecimal digits"},
                        {"al!ce render " + hash, "NAME ROLE sha256:HEX"},
                        {"unnamed-1 render " + hash, "another name"},
                        {hash, "has a hash without a name"},
                        {"alice render " + hash + " sessions=many", "sessions: 'many'; allowed: [0, 1000000]"},
                        {"alice render " + hash + " memory=4X", "suffixes K, M, G, T"},
                        {"alice render " + hash + " jobs=1 jobs=2", "jobs comes twice"},
                        {"alice render " + hash + " cores=1", "allowed: sessions=N, jobs=N, memory=SIZE"},
                        {"alice render " + hash + "\nalice view sha256:" + std::string(64, '0'), "names 'alice' again"},
                        {"alice render " + hash + "\nbob view " + hash, "is there already"},
                        {"alice render " + hash + "\n0123456789abcdef", "line 2"},
                        {"0123456789abcdef render of mine", "line 1"}};
  for (const Case& c : cases) {
    const std::string told = problem(c.text);
    EXPECT_NE(told.find(c.part), std::string::npos) << told;
    EXPECT_NE(told.find("token-file"), std::string::npos) << told;
    EXPECT_EQ(told.find("0123456789abcdef"), std::string::npos) << told;
  }
  write_file(in("tokens"), "alice render " + hash + " sessions=2 jobs=0 memory=64M");
  const auto tokens = AccessTokens::read(in("tokens"));
  ASSERT_TRUE(tokens.ok()) << tokens.error().to_string();
  const CallerPtr alice = tokens->find("0123456789abcdef");
  ASSERT_NE(alice, nullptr);
  EXPECT_EQ(alice->quotas, (TokenQuotas{2, 0, 64 << 20}));
  EXPECT_EQ(to_token_line(*alice), "alice render " + hash + " sessions=2 jobs=0 memory=67108864");
}

}  // namespace
}  // namespace helio::test
