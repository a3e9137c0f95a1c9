// What all connections of a web server share.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "server/base/access_control.h"
#include "server/web/bridged_call.h"
#include "server/web/page_files.h"
#include "server/web/web_access.h"

namespace helio {

class WebSocket;

// Outlives them.
struct WebSite {
  const PageFiles& files;
  const WebAccess& access;
  const AccessControl& tokens;
  BridgedCalls& calls;
  const std::chrono::milliseconds patience;
  std::function<std::string()> unready;                            // as WebServer::Sources
  std::function<bool(std::function<void(std::string)>)> metrics;
  const bool& stopping;         // no WebSocket may be opened any more
  std::function<void(const std::weak_ptr<WebSocket>&)> opened;
};

}  // namespace helio
