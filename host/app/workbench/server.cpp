#include "host/app/workbench/server.hpp"

#include <fmt/format.h>
#include <httplib.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "host/app/workbench/access_control.hpp"
#include "host/app/workbench/assets.hpp"
#include "host/app/workbench/supervisor.hpp"
#include "host/common/system/temporary_folder.hpp"

namespace flexspline::workbench {
namespace {

constexpr const char* kAddress = "127.0.0.1";
// Each open page holds one request that waits for changes.
constexpr std::size_t kThreads = 32;
constexpr std::size_t kLargestBody = 1'000'000'000;

// Nothing from other hosts, nothing inline, in no frame; plots set their sizes by style attributes of their own.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const httplib::Headers kHeaders{{"Content-Security-Policy", kPolicy},
                                {"X-Content-Type-Options", "nosniff"},
                                {"X-Frame-Options", "DENY"},
                                {"Referrer-Policy", "no-referrer"},
                                {"Cross-Origin-Opener-Policy", "same-origin"},
                                {"Cross-Origin-Resource-Policy", "same-origin"},
                                {"Cache-Control", "no-store"}};

Request request_of(const httplib::Request& http) {
  Request request{http.method, std::string(behind_token(http.path)), {}, http.body, {}};
  for (const auto& [key, value] : http.params) request.query.emplace(key, value);
  for (const auto& [key, file] : http.files) request.files.push_back({file.filename, file.content});
  return request;
}

// Unchanged: httplib compresses complete bodies at its highest level, which takes longer than all other work for an
// answer does, and nothing of it has to go through a network. `owner` keeps the content.
void put(httplib::Response& response, std::string_view content, const std::string& type,
         std::shared_ptr<const void> owner = nullptr) {
  if (content.empty()) return response.set_content("", type);
  response.set_content_provider(
      content.size(), type,
      [content, owner = std::move(owner)](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
        return sink.write(content.data() + offset, length);
      });
}

bool send_asset(const std::string& path, httplib::Response& response) {
  const auto send = [&](std::string_view content, const char* type) {
    put(response, content, type);
    return true;
  };
  if (path == "/") return send(kPage, "text/html; charset=utf-8");
  if (path == "/page.js") return send(kScript, "text/javascript; charset=utf-8");
  if (path == "/page.css") return send(kStyle, "text/css; charset=utf-8");
  return false;
}

// In the worker process.
void answer_until(httplib::Server& server, const Setup& setup, const std::function<bool()>& ends,
                  const std::string& token, int port) {
  Api api(setup);
  server.set_pre_routing_handler([&](const httplib::Request& http, httplib::Response& response) {
    const std::string host = http.get_header_value("Host"), origin = http.get_header_value("Origin");
    const std::string why = refusal({host, origin, http.path}, token, port);
    if (why.empty()) return httplib::Server::HandlerResponse::Unhandled;
    response.status = 403;
    response.set_content(fmt::format("Refused: {}.\n", why), "text/plain; charset=utf-8");
    return httplib::Server::HandlerResponse::Handled;
  });
  const auto handle = [&](const httplib::Request& http, httplib::Response& response) {
    const Request request = request_of(http);
    if (request.method == "GET" && send_asset(request.path, response)) return;
    const auto answer = std::make_shared<const Answer>(api.answer(request));
    response.status = answer->status;
    if (!answer->download.empty())
      response.set_header("Content-Disposition", fmt::format("attachment; filename=\"{}\"", answer->download));
    put(response, answer->body, answer->type, answer);
  };
  server.Get(".*", handle);
  server.Post(".*", handle);
  std::thread watch([&] {
    while (!ends()) std::this_thread::sleep_for(std::chrono::milliseconds(100));
    server.stop();
  });
  server.listen_after_bind();
  watch.join();
}

}  // namespace

void serve(Setup setup, const ServerOptions& serving) {
  httplib::Server server;
  server.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
  server.set_payload_max_length(kLargestBody);
  server.set_default_headers(kHeaders);
  server.set_tcp_nodelay(true);
  server.set_keep_alive_max_count(1000);
  server.set_keep_alive_timeout(2);  // an open connection delays the end
  const std::string token = new_token();
  const int port = serving.port > 0 ? (server.bind_to_port(kAddress, serving.port) ? serving.port : -1)
                                    : server.bind_to_any_port(kAddress);
  if (port <= 0)
    throw std::runtime_error(
        fmt::format("port {} of this machine is taken; give another --port, or none", serving.port));
  // Files that were dropped, and the tabs: for as long as the workbench runs.
  const system::TemporaryFolder scratch;
  JobTable jobs;
  setup.scratch = scratch.path();
  setup.jobs = &jobs;
  serving.listening(fmt::format("http://{}:{}/{}/", kAddress, port, token));
  const auto work = [&](const std::vector<Failure>& failures) {
    setup.failures = failures;
    answer_until(server, setup, serving.ends, token, port);
  };
  supervise(jobs, {.work = work, .ends = serving.ends});
}

}  // namespace flexspline::workbench
