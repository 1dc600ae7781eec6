# Homebrew's formula; `packaging/recipes` fills what stands between @ from the version and the sums of a release.
class Strapd < Formula
  desc "Strapdown attitude daemon: gyro samples in, attitude you can trust out"
  homepage "@REPOSITORY@"
  version "@VERSION@"
  license any_of: ["MIT", "Apache-2.0"]

  on_macos do
    depends_on arch: :arm64
    url "@REPOSITORY@/releases/download/v@VERSION@/strapd-@VERSION@-aarch64-apple-darwin.tar.gz"
    sha256 "@SHA256 strapd-@VERSION@-aarch64-apple-darwin.tar.gz@"
  end

  on_linux do
    on_intel do
      url "@REPOSITORY@/releases/download/v@VERSION@/strapd-@VERSION@-x86_64-unknown-linux-musl.tar.gz"
      sha256 "@SHA256 strapd-@VERSION@-x86_64-unknown-linux-musl.tar.gz@"
    end
    on_arm do
      url "@REPOSITORY@/releases/download/v@VERSION@/strapd-@VERSION@-aarch64-unknown-linux-musl.tar.gz"
      sha256 "@SHA256 strapd-@VERSION@-aarch64-unknown-linux-musl.tar.gz@"
    end
  end

  def install
    bin.install "strapd"
    man1.install Dir["man/*.1"]
    bash_completion.install "completions/strapd.bash" => "strapd"
    zsh_completion.install "completions/strapd.zsh" => "_strapd"
    fish_completion.install "completions/strapd.fish"
    doc.install "README.md", "CHANGELOG.md", "THIRD-PARTY-NOTICES.txt", "strapd.cdx.json"
  end

  test do
    system bin/"strapd", "simulate", "top", "--duration", "1", "-o", "top.csv"
    assert_predicate testpath/"top.csv", :exist?
  end
end
