// filiform serve: answers questions about tile sets over HTTP.
#include "index/errors.h"
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/commands/shared/web_page.h"
#include "tools/program/ending_watch.h"
#include "tools/program/interruption.h"
#include "tools/serve/http/log_entry.h"
#include "tools/serve/http/server.h"
#include "tools/serve/http/web_folder.h"
#include "tools/serve/people/people.h"
#include "tools/serve/people/secret.h"
#include "tools/serve/people/secret_file.h"
#include "tools/serve/routes/html.h"
#include "tools/serve/routes/routes.h"
#include "tools/serve/session/session_house.h"
#include "tools/serve/sets/open_files.h"
#include "tools/serve/sets/picture_maker.h"
#include "tools/serve/sets/set_catalogue.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <functional>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <spawn.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

struct ServeArguments {
  std::vector<std::string> sets, origins, frame_origins, hosts, proxies;
  std::string listen = "127.0.0.1:7878", token_file, budget = "1GiB", log = "text", source_url, neuroglancer,
              session_budget = "256MiB", session_folder, catalogue, link_key, tokens, user_header;
  std::shared_ptr<const RemoteArguments> remote;
  // Gets the address and the token; none: they are printed as a link, and requests are logged.
  std::function<void(const std::string& address, const std::string& token)> listens;
  bool no_pictures = false, no_token = false;
  double drain_first_s = 0;
  std::size_t most_sessions = 100;
  std::size_t session_threads = std::clamp(std::thread::hardware_concurrency(), 1U, 8U);
  std::size_t most_clients = 256;
  unsigned threads = std::max(1U, std::thread::hardware_concurrency());
};

// Lines on stderr from several threads. A line that cannot be written is lost; the service goes on.
class ServeLog {
 public:
  ServeLog(bool json, bool requests) : format_(json ? LogFormat::json : LogFormat::text), requests_(requests) {}
  void request(const LogEntry& entry) {
    if (requests_) line(logLine(entry, format_));
  }
  void problem(const std::string& what) { say("problem", what); }
  void note(const std::string& what) { say("note", what); }

 private:
  void say(const std::string& kind, const std::string& what) {
    const std::string now = utcTime(std::time(nullptr));
    line(format_ == LogFormat::json ? jsonText({{"time", now}, {kind, what}}) : now + ' ' + kind + ": " + what);
  }
  void line(const std::string& text) {
    const std::lock_guard lock(mutex_);
    std::cerr << text + '\n';
    std::cerr.clear();
  }
  const LogFormat format_;
  const bool requests_;
  std::mutex mutex_;
};

// An address for a link. Throws UsageError if it is none of HTTP.
void checkAddress(const char* option, const std::string& url) {
  const bool web = url.starts_with("https://") || url.starts_with("http://");
  const bool plain = std::all_of(url.begin(), url.end(), [](char c) { return c > 0x20 && c < 0x7F && c != '#'; });
  if (!url.empty() && (!web || !plain))
    throw UsageError(std::string(option) + " " + escaped(url, 80) +
                     ": give an address that begins with https:// or http://, without #");
}

// SCHEME://HOST[:PORT] of an address.
std::string webOrigin(const std::string& url) { return url.substr(0, url.find('/', url.find("://") + 3)); }

// The address of a page, with which a browser logs in.
std::string linkOf(const std::string& page, const std::string& token) {
  return token.empty() ? page : page + "?token=" + token;
}

// Who may ask. `own_token`: the server's own, if no option names tokens or users.
People peopleOf(const ServeArguments& a, const std::string& own_token) {
  if (!a.tokens.empty()) {
    People people = readPeople(a.tokens);
    if (people.hasUsers() && a.user_header.empty())
      throw UsageError("--tokens " + inShort(a.tokens) + ": has a [[user]], which needs --user-header NAME");
    return people;
  }
  People people = a.no_token              ? People()
                  : !a.token_file.empty() ? People::ofToken(readToken("--token-file", a.token_file))
                  : !own_token.empty()    ? People::ofToken(own_token)
                                          : People::listed();
  if (!a.user_header.empty()) people.addUsers({.entry = "*"});
  return people;
}

// The name of a header in lower case. Throws UsageError.
std::string userHeader(const ServeArguments& a) {
  const std::string name = lowerCase(a.user_header);
  const bool is_plain = name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") == std::string::npos;
  if (!is_plain || name.size() > 64)
    throw UsageError("--user-header " + inShort(a.user_header) + ": give the name of a header, such as X-User");
  if (!name.empty() && a.proxies.empty())
    throw UsageError("--user-header: name the proxy that sends this header too: --proxy ADDRESS");
  return name;
}

std::atomic<bool> reload_asked{false};  // by SIGHUP

int runServe(const ServeArguments& a) {
  if (!a.listens) {
    std::signal(SIGHUP, [](int) { reload_asked = true; });
    std::signal(SIGUSR1, SIG_IGN);
    std::signal(SIGUSR2, SIG_IGN);
  }
  checkAddress("--source-url", a.source_url);
  checkAddress("--neuroglancer", a.neuroglancer);
  ServeLog log(a.log == "json", !a.listens);
  SecretFile people_file(a.tokens.empty() ? "--token-file" : "--tokens", a.tokens.empty() ? a.token_file : a.tokens);
  SecretFile link_file("--link-key", a.link_key);
  const auto hasChanged = [&](SecretFile& file) {
    return file.hasChanged([&](const std::string& line) { log.problem(line); });
  };
  hasChanged(people_file);  // what they are now, before they are read
  hasChanged(link_file);
  // Other users of this machine reach its loopback too.
  const std::string user_header = userHeader(a);
  const bool named = !a.token_file.empty() || !a.tokens.empty() || !user_header.empty() || a.no_token;
  const std::string own_token = named ? "" : randomText();
  AccessRules rules{
      .people = peopleOf(a, own_token), .origins = a.origins, .frame_origins = a.frame_origins, .hosts = a.hosts};
  rules.tell = [&log](const std::string& line) { log.problem(line); };
  if (!a.link_key.empty()) rules.link_key = readToken("--link-key", a.link_key);
  if (!a.neuroglancer.empty()) rules.origins.push_back(webOrigin(a.neuroglancer));
  Access access(std::move(rules));
  const auto entries = [&a] {
    RemoteOptions remote = a.remote->options();
    std::vector<ShelfEntry> given = shelfEntries(a.sets, remote);
    if (!a.catalogue.empty())
      for (ShelfEntry& entry : readCatalogue(a.catalogue, remote)) given.push_back(std::move(entry));
    if (given.empty()) throw UsageError("give a SET, or --catalogue FILE with sets");
    for (const ShelfEntry& entry : given)
      if (!entry.readers.empty() && a.tokens.empty() && a.user_header.empty())
        throw UsageError("--catalogue: the set '" + escaped(entry.name, 60) +
                         "' has readers; name people with --tokens or --user-header");
    const std::size_t files_of_set = filesOfSet(raiseOpenFiles(), given.size(), a.most_clients);
    for (ShelfEntry& entry : given) entry.open_files = files_of_set;
    return given;
  };
  SetShelf shelf(entries(), parseBytes("--budget", a.budget));
  Metrics metrics;
  std::optional<PictureMaker> pictures;
  if (!a.no_pictures) pictures.emplace();
  const Service service{shelf,        access,         metrics,        FILIFORM_VERSION, pictures ? &*pictures : nullptr,
                        a.source_url, a.neuroglancer, findWebFolder()};
  const Routes routes(service, [&log](const std::string& line) { log.problem(line); });
  std::vector<std::string> reported;  // problems of the last refresh
  SessionHouse house(shelf, {.budget_bytes = parseBytes("--session-budget", a.session_budget),
                             .most_sessions = a.most_sessions,
                             .threads = a.session_threads,
                             .record_folder = a.session_folder});
  ServerOptions options{
      .listen = a.listen, .open = access.isOpen(), .most_clients = a.most_clients, .threads = a.threads};
  options.proxies = a.proxies;
  options.user_header = user_header;
  options.sessions = &house;
  options.desks = &shelf;
  options.version = FILIFORM_VERSION;
  options.stop = &interruptFlag();
  options.log = [&log](const LogEntry& entry) { log.request(entry); };
  options.drain_first_s = a.drain_first_s;
  const auto readAgain = [&](SecretFile& file, bool asked, const auto& read) {
    if (!hasChanged(file) && (!asked || file.path().empty())) return;
    try {
      read();
      log.note(file.option() + " was read again");
    } catch (const std::exception& error) {
      log.problem(std::string(error.what()) + "; the old one stays");
    }
  };
  options.each_second = [&] {
    const bool asked = reload_asked.exchange(false);
    readAgain(people_file, asked, [&] { access.setPeople(peopleOf(a, own_token)); });
    readAgain(link_file, asked, [&] { access.setLinkKey(readToken("--link-key", a.link_key)); });
    if (asked) {
      try {
        shelf.replace(entries());
        log.note("SIGHUP: " + std::to_string(shelf.all().size()) + " of " + std::to_string(shelf.states().size()) +
                 " sets are open");
      } catch (const std::exception& error) {
        log.problem(std::string("SIGHUP changed nothing: ") + error.what());
      }
    }
    std::vector<std::string> problems = shelf.refresh();
    if (problems != reported)
      for (const std::string& problem : problems) log.problem(problem);
    reported = std::move(problems);
    for (const std::string& problem : house.takeProblems()) log.problem(problem);
    const SessionFigures figures = house.figures();
    metrics.session_ticks = figures.ticker.ticks;
    metrics.session_late_ticks = figures.ticker.late;
    metrics.session_busy_ms = figures.ticker.busy_ns / 1'000'000;
    metrics.session_tile_bytes = figures.tile_bytes;
  };
  EndingWatch watch = watchForSilentFiles();
  Server server(routes, metrics, options);
  if (a.listens) {
    a.listens(server.address(), own_token);
  } else {
    std::cout << linkOf(server.address() + (own_token.empty() ? "" : "/"), own_token) << std::endl;
    if (!own_token.empty())
      log.note(
          "the link holds a token that ends with this run; --token-file keeps one, --no-token answers all users of "
          "this machine");
  }
  server.run();
  house.closeAll();  // writes recordings
  for (const std::string& problem : house.takeProblems()) log.problem(problem);
  watch.begin();
  return 0;
}

// A file that sends the browser on, because the list of processes would show a token in the address.
class Doorway {
 public:
  explicit Doorway(const std::string& address) {
    const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
    path_ =
        (runtime != nullptr && *runtime != '\0' ? std::string(runtime) : std::string("/tmp")) + "/filiform-XXXXXX.html";
    const int file = ::mkstemps(path_.data(), 5);  // for this user alone
    const std::string html =
        "<!DOCTYPE html><meta http-equiv=\"refresh\" content=\"0;url=" + htmlText(address) + "\">\n";
    const bool written = file >= 0 && ::write(file, html.data(), html.size()) == static_cast<ssize_t>(html.size());
    const int error = errno;
    if (file >= 0) ::close(file);
    if (!written) throw IoError(path_, "cannot be written", error);
  }
  Doorway(const Doorway&) = delete;
  Doorway& operator=(const Doorway&) = delete;
  ~Doorway() { ::unlink(path_.c_str()); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// Starts the desktop's browser. False: there is no xdg-open.
bool openInBrowser(const std::string& path) {
  std::string program = "xdg-open", argument = path;
  char* words[] = {program.data(), argument.data(), nullptr};
  pid_t child = 0;
  posix_spawn_file_actions_t quiet;
  posix_spawn_file_actions_init(&quiet);
  posix_spawn_file_actions_addopen(&quiet, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  const bool started = ::posix_spawnp(&child, program.c_str(), &quiet, nullptr, words, environ) == 0;
  posix_spawn_file_actions_destroy(&quiet);
  if (started) std::thread([child] { ::waitpid(child, nullptr, 0); }).detach();
  return started;
}

}  // namespace

int travelInBrowser(const std::string& set, const std::shared_ptr<const RemoteArguments>& remote) {
  if (findWebFolder().empty())
    throw UsageError(
        "--web: the page is not built; run `tools/setup --web && cmake --workflow --preset web`, or leave out --web "
        "for "
        "the window");
  ServeArguments a;
  a.sets = {set};
  a.remote = remote;
  a.listen = "127.0.0.1:0";
  a.no_pictures = true;
  std::optional<Doorway> doorway;
  a.listens = [&](const std::string& address, const std::string& token) {
    const SetShelf shelf(shelfEntries({set}, remote->options()), 1 << 20);
    const std::string page = linkOf(address + "/travel/" + urlPart(shelf.all().front()->name()), token);
    doorway.emplace(page);
    std::cout << page << std::endl;
    if (!openInBrowser(doorway->path())) std::cerr << "filiform: note: no xdg-open here; open this address yourself\n";
    std::cerr << "filiform: note: the set is served until Ctrl-C\n";
  };
  return runServe(a);
}

void addServe(CLI::App& app, Chosen& chosen) {
  auto a = std::make_shared<ServeArguments>();
  CLI::App* command = app.add_subcommand("serve", "Answer questions about tile sets over HTTP");
  command->footer(
      "Examples:\n  filiform serve column.fil\n  filiform serve column.fil --listen 127.0.0.1:0 --log json\n"
      "The first line on standard output is a link with a token, made for this run; with --token-file or --no-token, "
      "the address.\nSIGTERM or Ctrl-C: sends the answers in work, then exits with code 0. tools/serve/README.md lists "
      "the routes.");
  command->add_option(
      "SET", a->sets,
      "tile sets or their addresses, or NAME=ADDRESS; else the name of each is that of its folder without .fil");
  command->add_option("--catalogue", a->catalogue, "serve also the sets of this file, which SIGHUP reads again")
      ->type_name("FILE");
  command
      ->add_option("--drain-first", a->drain_first_s,
                   "after SIGTERM, answer on for this many seconds, while /readyz says 503")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 3600.0));
  command->add_option("--listen", a->listen, "listen on this address; port 0: a free one")
      ->type_name("ADDRESS:PORT")
      ->capture_default_str();
  command
      ->add_option("--token-file", a->token_file,
                   "answer only requests with the token in the first line of this file; default: a token of this run")
      ->type_name("FILE");
  command
      ->add_option("--tokens", a->tokens,
                   "answer only the people of this file: their tokens or names, what they may do and see")
      ->type_name("FILE")
      ->excludes("--token-file");
  command->add_flag("--no-token", a->no_token, "answer everybody on this machine")
      ->excludes("--token-file")
      ->excludes("--tokens");
  command
      ->add_option("--user-header", a->user_header,
                   "take the name of the user from this header of a --proxy, which has checked it")
      ->type_name("NAME");
  command
      ->add_option("--link-key", a->link_key,
                   "make the links for Neuroglancer and CATMAID from the text in this file, so that servers share them")
      ->type_name("FILE");
  command->add_option("--origin", a->origins, "let the pages of this site ask; repeatable")
      ->type_name("URL")
      ->allow_extra_args(false);
  command
      ->add_option("--frame-origin", a->frame_origins,
                   "let the pages of this site hold the server's pages in a frame, such as a notebook; repeatable")
      ->type_name("URL")
      ->allow_extra_args(false);
  command->add_option("--host", a->hosts, "accept requests to this name, such as that of a proxy; repeatable")
      ->type_name("NAME")
      ->allow_extra_args(false);
  command
      ->add_option("--proxy", a->proxies,
                   "take the client's address from the X-Forwarded-For of this proxy; repeatable")
      ->type_name("ADDRESS|NETWORK")
      ->allow_extra_args(false);
  command
      ->add_option("--neuroglancer", a->neuroglancer,
                   "link the page to the Neuroglancer at this address, and let it ask, as --origin does")
      ->type_name("URL");
  command->add_option("--source-url", a->source_url, "name this address on the page as that of the program's source")
      ->type_name("URL");
  command->add_flag("--no-pictures", a->no_pictures, "draw no pictures of sets");
  command->add_option("--max-clients", a->most_clients, "keep at most N connections open")
      ->type_name("N")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  command->add_option("--threads", a->threads, "answer on N threads")
      ->capture_default_str()
      ->check(CLI::Range(1, 1024));
  command->add_option("--budget", a->budget, "keep at most this memory of tiles and sample ids, for all sets together")
      ->capture_default_str()
      ->type_name("BYTES");
  command
      ->add_option("--max-sessions", a->most_sessions,
                   "allow at most N sessions at /v1/session, and no more than the threads have time for")
      ->type_name("N")
      ->capture_default_str()
      ->check(CLI::Range(1, 10000));
  command
      ->add_option("--session-threads", a->session_threads,
                   "tick the sessions on N threads: up to 69 moving hands each")
      ->type_name("N")
      ->capture_default_str()
      ->check(CLI::Range(1, 64));
  command
      ->add_option("--session-budget", a->session_budget,
                   "keep at most this memory of tiles, for all sessions together")
      ->capture_default_str()
      ->type_name("BYTES");
  command
      ->add_option("--record-sessions", a->session_folder, "record each session in this folder, for 'filiform replay'")
      ->type_name("DIR")
      ->check(CLI::ExistingDirectory);
  command->add_option("--log", a->log, "write a line for each request to stderr: text or json")
      ->capture_default_str()
      ->check(CLI::IsMember({"text", "json"}));
  a->remote = addRemoteArguments(*command, "--source-token-file");
  command->callback([a, &chosen] { chosen = [a] { return runServe(*a); }; });
}

}  // namespace filiform::tools
