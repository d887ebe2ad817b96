#include "tools/studio/server.h"

#include <fmt/format.h>
#include <httplib.h>

#include <atomic>
#include <chrono>
#include <limits>
#include <mutex>
#include <nlohmann/json.hpp>

#include "libsurf/base/base64.h"
#include "libsurf/base/error.h"
#include "libsurf/base/log.h"
#include "libsurf/segment/presets.h"
#include "tools/common/field_names.h"
#include "tools/common/typed_options.h"
#include "tools/studio/access.h"
#include "tools/studio/exports.h"
#include "tools/studio/itksnap.h"
#include "tools/studio/object_options.h"
#include "tools/studio/page_files.h"
#include "tools/studio/state_json.h"
#include "tools/studio/volume_file.h"

namespace surfseg::studio {
namespace {

using httplib::Request;
using httplib::Response;
using nlohmann::ordered_json;

constexpr std::size_t kMostBody = 1 << 20, kMostImage = std::size_t(4) << 30;
constexpr int kThreads = 32, kMostStreams = 16;  // a stream holds a thread
constexpr std::chrono::milliseconds kPing(1000), kBetweenProgress(100);
constexpr const char* kJson = "application/json";

const httplib::Headers kHeaders = {
    {"Content-Security-Policy",
     "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' "
     "data: "
     "blob:; connect-src 'self' data: blob:; frame-ancestors 'none'; base-uri 'none'; form-action "
     "'none'"},
    {"X-Content-Type-Options", "nosniff"},
    {"Referrer-Policy", "no-referrer"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Cross-Origin-Opener-Policy", "same-origin"},
    {"Cache-Control", "no-store"}};

/// A client's mistake; its text is one line.
struct Refusal {
  int status;
  std::string text;
  bool exists = false;
};

void refuse(Response& response, const Refusal& refusal) {
  ordered_json body = {{"error", with_option_names(refusal.text, "surfseg")}};
  if (refusal.exists) body["exists"] = true;
  response.status = refusal.status;
  response.set_content(body.dump(-1, ' ', false, ordered_json::error_handler_t::replace), kJson);
}

template <class Work>
void answer(Response& response, Work&& work) {
  try {
    work();
  } catch (const Refusal& refusal) {
    refuse(response, refusal);
  } catch (const ClickChanged& error) {
    refuse(response, {409, error.what()});
  } catch (const FileExists& error) {
    refuse(response, {409, error.what(), true});
  } catch (const surf::OutputError& error) {
    surf::log(surf::LogLevel::kWarning, error.what());
    refuse(response, {500, error.what()});
  } catch (const surf::Error& error) {
    refuse(response, {400, error.what()});
  } catch (const nlohmann::json::exception&) {
    refuse(response, {400, "the request's JSON lacks what it needs, or has another type"});
  } catch (const std::exception& error) {
    refuse(response, {500, text_of(error)});
  }
}

/// Of an answer that the HTTP library gives by itself.
const char* words_of(int status) {
  return status == 404   ? "there is no such file or request"
         : status == 413 ? "the request is too large"
         : status == 414 ? "the address is too long"
         : status >= 500 ? "internal error"
                         : "the request cannot be understood";
}

Vector<3> point_of(const ordered_json& request, const char* key = "point") {
  const auto numbers = request.at(key).get<std::vector<double>>();
  if (numbers.size() != 3) throw Refusal{400, fmt::format("{}: expected three numbers", key)};
  return {numbers[0], numbers[1], numbers[2]};
}

surf::segment::Colour colour_of(const std::string& text) {
  unsigned r, g, b;
  int n = 0;
  if (text.size() != 7 || std::sscanf(text.c_str(), "#%2x%2x%2x%n", &r, &g, &b, &n) != 3 || n != 7)
    throw Refusal{400, "colour: expected #rrggbb"};
  return {std::uint8_t(r), std::uint8_t(g), std::uint8_t(b)};
}

int number_of(const Request& request, const char* name) {
  try {
    return std::stoi(request.get_param_value(name));
  } catch (const std::exception&) {
    throw Refusal{400, fmt::format("{}: expected a number", name)};
  }
}

bool is_route_of_itksnap(const std::string& path) {
  return path == "/status" || path.starts_with("/v2/") || path.starts_with("/upload_raw/") ||
         path.starts_with("/process_scribble_interaction/") ||
         path.starts_with("/process_lasso_interaction/") ||
         path.starts_with("/reset_interactions/");
}

std::string dumped(const ordered_json& json) {
  // Names of files may be no UTF-8.
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace

struct Server::Impl {
  Dialogue& dialogue;
  std::string version, token = random_token();
  LaunchCode launch_code;
  httplib::Server http;
  int port = 0;

  std::mutex mutex;
  std::int64_t volume_number = 0;  ///< that `volume_bytes` is of
  std::shared_ptr<const std::string> volume_bytes;
  std::atomic<std::uint64_t> last_stream = 0;
  std::atomic<bool> is_ending = false;
  bool has_itksnap = false;
  ItkSnapSessions itksnap;

  Impl(Dialogue& d, const std::string& v) : dialogue(d), version(v) {}

  httplib::Server::HandlerResponse check(const Request& request, Response& response) {
    const Credentials credentials = {
        request.get_header_value("Host"), request.get_header_value("Origin"),
        request.get_header_value("Sec-Fetch-Site"), request.get_header_value("Cookie"),
        request.get_header_value("Authorization")};
    const int status = status_of(credentials, port, token);
    const bool is_itksnap = has_itksnap && status == 401 && is_route_of_itksnap(request.path) &&
                            credentials.origin.empty() && credentials.fetch_site.empty();
    if (status == 200 || is_itksnap) return httplib::Server::HandlerResponse::Unhandled;
    // The first visit: the token goes into a cookie, from the address or for the launch code there.
    if (status == 401 && request.method == "GET" && request.path == "/" &&
        (is_same_secret(request.get_param_value("token"), token) ||
         launch_code.opens(request.get_param_value("launch")))) {
      response.set_header(
          "Set-Cookie",
          fmt::format("surfseg-{}={}; HttpOnly; SameSite=Strict; Path=/", port, token));
      response.set_redirect("/");
      return httplib::Server::HandlerResponse::Handled;
    }
    refuse(response, {status, status == 401   ? "no token: use the address that the program printed"
                              : status == 403 ? "another page may not ask"
                                              : "another host"});
    return httplib::Server::HandlerResponse::Handled;
  }

  /// Made once for a volume.
  std::shared_ptr<const std::string> volume() {
    const auto state = dialogue.state();
    if (!state->volume) throw Refusal{404, "no volume is open"};
    std::lock_guard lock(mutex);
    if (!volume_bytes || volume_number != state->volume->number) {
      volume_bytes.reset();
      volume_bytes = std::make_shared<const std::string>(
          volume_file(state->volume->volume, display_of(state->volume->volume).coarser_by));
      volume_number = state->volume->number;
    }
    return volume_bytes;
  }

  void surface(const Request& request, Response& response) {
    const int id = number_of(request, "object");
    int frame = 0;
    const auto shape = dialogue.surface(id, &frame);
    if (!shape) throw Refusal{404, fmt::format("object {} has no surface", id)};
    const surf::segment::Certainty<3>* certainty = nullptr;
    const auto state = dialogue.state();
    for (const ObjectState& object : state->objects)
      if (frame == 0 && object.id == id && &object.object.result->shape == shape.get() &&
          object.object.result->certainty)
        certainty = &*object.object.result->certainty;
    response.set_content(surface_bytes(*shape, frame, certainty), "application/octet-stream");
  }

  void candidate(const Request& request, Response& response) {
    const int id = number_of(request, "object"), number = number_of(request, "number");
    const auto state = dialogue.state();
    for (const ObjectState& object : state->objects) {
      const auto& proposals = object.object.result->proposals;
      if (object.id == id && number >= 1 && std::size_t(number) <= proposals.size())
        return response.set_content(
            surface_bytes(proposals[std::size_t(number) - 1].shape, 0, nullptr),
            "application/octet-stream");
    }
    throw Refusal{404, fmt::format("object {} has no proposal {}", id, number)};
  }

  std::string command(int id) {
    try {
      return replay_command(*dialogue.state(), id);
    } catch (const surf::UsageError& error) {
      throw Refusal{404, error.what()};
    }
  }

  /// With its job as it is now: that of the state is as it was when the state was published.
  std::string told(const State& state) const {
    ordered_json out = to_json(state, dialogue.folder(), version);
    if (const auto job = dialogue.job_of(state)) out["job"] = to_json(*job);
    return dumped(out);
  }

  /// An event; "" if nothing is computed.
  std::string progress() const {
    const auto job = dialogue.job();
    return job ? "event: progress\ndata: " + dumped(to_json(*job)) + "\n\n" : "";
  }

  /// What one who listens was told last.
  struct Stream {
    std::uint64_t number, revision = std::uint64_t(-1), tick = 0;
    std::chrono::steady_clock::time_point last_progress = {};
  };

  void events(const Request&, Response& response) {
    response.set_chunked_content_provider(
        "text/event-stream",
        [this, stream = Stream{++last_stream}](std::size_t, httplib::DataSink& sink) mutable {
          try {
            return tell_next(stream, sink);
          } catch (const std::exception& error) {
            // The library would let it end the program; the page asks for another stream.
            warn_of(error);
            sink.done();
            return true;
          }
        });
  }

  bool tell_next(Stream& stream, httplib::DataSink& sink) {
    // A newer one takes the place.
    if (is_ending || stream.number + kMostStreams <= last_stream) {
      sink.done();
      return true;
    }
    std::string out;
    const auto state = dialogue.state();
    const auto now = std::chrono::steady_clock::now();
    if (state->revision != stream.revision) {
      stream.revision = state->revision;
      stream.tick = dialogue.tick();
      out = "event: state\ndata: " + told(*state) + "\n\n";
    } else if (dialogue.tick() != stream.tick) {
      if (now - stream.last_progress < kBetweenProgress) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
        return true;
      }
      stream.last_progress = now;
      stream.tick = dialogue.tick();
      out = progress();
    } else {
      dialogue.wait_for_change(stream.revision, stream.tick, kPing);
      if (state->revision != dialogue.state()->revision || dialogue.tick() != stream.tick)
        return true;
      // What has no steps, such as reading, goes on, too.
      out = progress();
      if (out.empty()) out = ": ping\n\n";
    }
    return out.empty() || sink.write(out.data(), out.size());
  }

  void act(const ordered_json& request) {
    const auto action = request.at("action").get<std::string>();
    const auto whole = [&](const char* key, int least) {
      const ordered_json& value = request.at(key);
      if (!value.is_number_integer() || value.get<long>() < least ||
          value.get<long>() > std::numeric_limits<int>::max())
        throw Refusal{400, fmt::format("{}: expected a whole number, {} or more; got {}", key,
                                       least, value.dump())};
      return value.get<int>();
    };
    const auto object = [&] { return whole("object", 0); };
    const auto index = [&] { return std::size_t(whole("index", 0)); };
    const auto was = [&] {
      return request.contains("was") ? std::optional(point_of(request, "was")) : std::nullopt;
    };
    if (action == "open") {
      const auto path = request.at("path").get<std::string>();
      const auto entries = entries_of(dialogue.folder());
      if (std::none_of(entries.begin(), entries.end(),
                       [&](const FolderEntry& entry) { return entry.name == path; }))
        throw Refusal{400, fmt::format("'{}' is nothing that can be opened in this folder", path)};
      std::optional<std::string> series;
      if (request.contains("series")) series = request["series"].get<std::string>();
      dialogue.open(dialogue.folder() / path, series);
    } else if (action == "close") {
      dialogue.close();
    } else if (action == "add_object") {
      dialogue.add_object(request.value("name", ""));
    } else if (action == "remove_object") {
      dialogue.remove_object(object());
    } else if (action == "rename") {
      dialogue.rename(object(), request.at("name").get<std::string>());
    } else if (action == "recolour") {
      dialogue.recolour(object(), colour_of(request.at("colour").get<std::string>()));
    } else if (action == "click") {
      const auto side = request.at("side").get<std::string>();
      if (side != "inside" && side != "outside")
        throw Refusal{400, "side: expected inside or outside"};
      dialogue.click(object(), point_of(request),
                     side == "inside" ? Side::kInside : Side::kOutside);
    } else if (action == "move_click") {
      dialogue.move_click(object(), index(), point_of(request), was());
    } else if (action == "delete_click") {
      dialogue.delete_click(object(), index(), was());
    } else if (action == "choose") {
      dialogue.choose(object(), std::size_t(whole("number", 1) - 1));
    } else if (action == "set_options") {
      const ordered_json& changes = request.at("options");
      dialogue.set_options(object(),
                           [&](Options<3>& options) { change_options(options, changes); });
    } else if (action == "preset") {
      const auto name = request.at("name").get<std::string>();
      const auto state = dialogue.state();
      if (!state->volume) throw Refusal{409, "no volume is open"};
      const Options<3> preset =
          typed_options<3>({"--preset", name}, state->volume->volume.voxel_size());
      dialogue.set_options(object(),
                           [&](Options<3>& options) { options = with_preset(options, preset); });
    } else if (action == "evolve") {
      dialogue.evolve(object());
    } else if (action == "stop") {
      dialogue.stop();
    } else if (action == "undo") {
      dialogue.undo(request.contains("object") ? object() : 0);
    } else if (action == "redo") {
      dialogue.redo(object());
    } else if (action == "quit") {
      is_ending = true;
      http.stop();
    } else {
      throw Refusal{400, fmt::format("there is no action '{}'", action)};
    }
  }

  void post(const Request& request, Response& response,
            const std::function<ordered_json(const ordered_json&)>& work) {
    answer(response, [&] {
      if (request.body.size() > kMostBody) throw Refusal{413, "the request is too large"};
      // What a form of another page could send has another type.
      if (!request.get_header_value("Content-Type").starts_with(kJson))
        throw Refusal{415, "expected application/json"};
      const ordered_json body = ordered_json::parse(request.body, nullptr, false);
      if (!body.is_object()) throw Refusal{400, "expected a JSON object"};
      response.set_content(dumped(work(body)), kJson);
    });
  }

  /// As itksnap-dls 0.1.2 answers; sessions are named in the path.
  void add_itksnap_routes() {
    const auto json = [](Response& response, const ordered_json& body) {
      response.set_content(dumped(body), kJson);
    };
    const auto result = [json](Response& response, const std::string& mask) {
      json(response, {{"status", "success"}, {"result", surf::base64(mask)}});
    };
    const auto is_inside = [](const Request& request) {
      return request.get_param_value("foreground") != "false";
    };
    const auto route = [](auto work) {
      return [work](const Request& request, Response& response) {
        answer(response, [&] { work(request, response); });
      };
    };
    const auto session = [this](const Request& request) {
      return itksnap.find(request.matches[1]);
    };
    const auto file = [](const Request& request) {
      if (!request.has_file("file")) throw Refusal{400, "the part 'file' is missing"};
      return request.get_file_value("file").content;
    };
    const auto metadata = [](const Request& request) {
      return request.has_file("metadata") ? request.get_file_value("metadata").content
                                          : request.get_param_value("metadata");
    };
    http.Get("/status", route([=](const Request&, Response& r) {
               json(r, {{"status", "ok"}, {"version", "0.1.2"}});
             }));
    http.Get("/v2/models", route([=](const Request&, Response& r) {
               json(r, {{"models",
                         {{{"id", "surfseg"},
                           {"dimensions", 3},
                           {"channels", {1}},
                           {"interactions", {"point", "scribble"}}}}}});
             }));
    http.Get(R"(/v2/start_session/([\w.-]+))", route([=, this](const Request&, Response& r) {
               json(r, {{"session_id", itksnap.start()}});
             }));
    http.Post(R"(/upload_raw/(\w+))", route([=](const Request& q, Response& r) {
                session(q)->set_image(file(q), metadata(q));
                json(r, {{"status", "success"}});
              }));
    http.Get(R"(/v2/process_point_interaction/(\w+))", route([=](const Request& q, Response& r) {
               std::array<int, 3> index;
               if (q.get_param_value_count("point") != 3)
                 throw Refusal{400, "point: expected three indices"};
               for (std::size_t axis = 0; axis < 3; ++axis)
                 index[axis] = std::atoi(q.get_param_value("point", axis).c_str());
               result(r, session(q)->click(index, is_inside(q)));
             }));
    for (const char* path :
         {R"(/process_scribble_interaction/(\w+))", R"(/process_lasso_interaction/(\w+))"})
      http.Post(path, route([=](const Request& q, Response& r) {
                  result(r, session(q)->stroke(file(q), metadata(q), is_inside(q)));
                }));
    http.Get(R"(/reset_interactions/(\w+))", route([=](const Request& q, Response& r) {
               session(q)->reset();
               json(r, {{"status", "success"}});
             }));
    http.Get(R"(/v2/end_session/(\w+))", route([=, this](const Request& q, Response& r) {
               itksnap.end(q.matches[1]);
               json(r, {{"status", "success"}});
             }));
  }

  void add_routes() {
    http.set_pre_routing_handler(
        [this](const Request& request, Response& response) { return check(request, response); });
    for (const PageFile& file : page_files())
      http.Get(std::string(file.path), [file](const Request&, Response& response) {
        response.set_header("Content-Encoding", "gzip");
        response.set_content(file.gzip.data(), file.gzip.size(), std::string(file.type));
      });
    const auto get = [this](const char* path, auto work) {
      http.Get(path, [work](const Request& request, Response& response) {
        answer(response, [&] { work(request, response); });
      });
    };
    get("/api/state", [this](const Request&, Response& response) {
      response.set_content(told(*dialogue.state()), kJson);
    });
    get("/api/options", [](const Request&, Response& response) {
      response.set_content(dumped(describe_options()), kJson);
    });
    get("/api/volume.nii.gz", [this](const Request& request, Response& response) {
      const auto bytes = volume();
      // The library takes any Range, and promises as many bytes; it made the request for us alone.
      for (auto& [first, last] : const_cast<Request&>(request).ranges) {
        if (first >= 0 && std::size_t(first) >= bytes->size())
          throw Refusal{416, "the volume ends before that range"};
        last = std::min(last, decltype(last)(first < 0 ? last : bytes->size() - 1));
      }
      response.set_content_provider(
          bytes->size(), "application/gzip",
          [bytes](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
            if (offset >= bytes->size()) return false;
            const std::size_t n_left = bytes->size() - offset;
            return sink.write(bytes->data() + offset,
                              std::min({length, n_left, std::size_t(1) << 20}));
          });
    });
    get("/api/surface", [this](const Request& q, Response& r) { surface(q, r); });
    get("/api/candidate", [this](const Request& q, Response& r) { candidate(q, r); });
    get("/api/command", [this](const Request& q, Response& r) {
      r.set_content(dumped({{"text", command(number_of(q, "object"))}}), kJson);
    });
    http.Get("/api/events", [this](const Request& q, Response& r) { events(q, r); });
    http.Post("/api/do", [this](const Request& request, Response& response) {
      post(request, response, [this](const ordered_json& body) {
        act(body);
        return ordered_json{{"revision", dialogue.state()->revision}};
      });
    });
    http.Post("/api/export", [this](const Request& request, Response& response) {
      post(request, response, [this](const ordered_json& body) {
        const Exported file =
            export_file(dialogue, {.what = body.at("what").get<std::string>(),
                                   .object = body.value("object", 0),
                                   .format = body.value("format", ""),
                                   .space = body.value("space", "lps"),
                                   .name = body.value("name", ""),
                                   .may_overwrite = body.value("overwrite", false)});
        return ordered_json{{"file", file.name}, {"bytes", file.bytes}};
      });
    });
  }
};

Server::Server(Dialogue& dialogue, int port, const std::string& version, bool has_itksnap)
    : impl_(std::make_unique<Impl>(dialogue, version)) {
  httplib::Server& http = impl_->http;
  http.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
  impl_->has_itksnap = has_itksnap;
  http.set_payload_max_length(has_itksnap ? kMostImage : kMostBody);
  http.set_keep_alive_max_count(1000);
  http.set_keep_alive_timeout(5);
  http.set_read_timeout(5, 0);
  http.set_write_timeout(10, 0);
  http.set_tcp_nodelay(true);
  // The library's own choice would let another program listen on the same port.
  http.set_socket_options([](socket_t socket) {
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  http.set_default_headers(kHeaders);
  http.set_error_handler([](const Request&, Response& response) {
    if (response.body.empty()) refuse(response, {response.status, words_of(response.status)});
  });
  impl_->add_routes();
  if (has_itksnap) impl_->add_itksnap_routes();
  if (port == 0)
    impl_->port = http.bind_to_any_port("127.0.0.1");
  else if (http.bind_to_port("127.0.0.1", port))
    impl_->port = port;
  if (impl_->port <= 0)
    throw surf::UsageError(
        fmt::format("--port {}: it is taken or not allowed; leave it out for a free one", port));
}

Server::~Server() = default;

std::string Server::address() const {
  return fmt::format("http://127.0.0.1:{}/?token={}", impl_->port, impl_->token);
}

std::string Server::launch_address() const {
  return fmt::format("http://127.0.0.1:{}/?launch={}", impl_->port, impl_->launch_code.text());
}

int Server::port() const { return impl_->port; }
void Server::run() { impl_->http.listen_after_bind(); }

void Server::stop() {
  impl_->is_ending = true;
  impl_->http.stop();
}

}  // namespace surfseg::studio
