#!/usr/bin/env bash
# Installs what the tests need on Debian: lavapipe with ray query (Mesa 25 or newer), the Vulkan loader and validation
# layers, a virtual X display, and OpenArena's free game data. Says nothing and changes nothing when all is there.
set -euo pipefail

# Mesa's lavapipe has VK_KHR_ray_query since 24.1 and runs clean under the validation layers from 25.0.
readonly mesa_minimum=25

readonly packages=(
    libvulkan1 vulkan-validationlayers vulkan-tools                           # Vulkan itself
    xvfb xdotool imagemagick libxkbcommon-x11-0 libxcursor1 libxi6 libxrandr2 # window tests
    g++                                                                       # the `compile-shaders` feature builds glslang
    openarena-data openarena-081-maps openarena-081-textures openarena-081-players openarena-081-misc
    openarena-085-data openarena-088-data openarena-oacmp1 # maps and textures to render
)

fail() {
    echo "tests/setup.sh: $*" >&2
    exit 1
}

installed_version() {
    dpkg-query --show --showformat='${db:Status-Status} ${Version}' "$1" 2>/dev/null | sed -n 's/^installed //p'
}

mesa_is_new_enough() {
    local version
    version=$(installed_version mesa-vulkan-drivers)
    [ -n "$version" ] && dpkg --compare-versions "$version" ge "$mesa_minimum"
}

as_root() {
    if [ "$(id -u)" = 0 ]; then
        "$@"
    elif command -v sudo >/dev/null; then
        sudo "$@"
    else
        fail "needs root to install packages; run it as root or install sudo"
    fi
}

# Runs a command with its output hidden; shows that output only if it fails.
quietly() {
    local log status=0
    log=$(mktemp)
    "$@" >"$log" 2>&1 || status=$?
    if [ "$status" != 0 ]; then
        cat "$log" >&2
        rm -f "$log"
        fail "failed (exit $status): $*"
    fi
    rm -f "$log"
}

# Prints, as one-line-style entries, this machine's own sources for suite $1, renamed to suite $2. Reading them from the
# machine keeps mirrors, proxies and keys as its administrator set them.
derive_sources() {
    local from=$1 to=$2 file
    for file in /etc/apt/sources.list /etc/apt/sources.list.d/*.list; do
        [ -f "$file" ] || continue
        awk -v from="$from" -v to="$to" '
            $1 == "deb" {
                # The suite follows the address, which follows an optional bracketed list of options.
                suite = 3
                if ($2 ~ /^\[/) { for (i = 2; i <= NF && $i !~ /\]$/; i++) ; suite = i + 2 }
                if ($suite == from) { $suite = to; print }
            }' "$file"
    done
    for file in /etc/apt/sources.list.d/*.sources; do
        [ -f "$file" ] || continue
        awk -v from="$from" -v to="$to" '
            function flush_stanza(    n, list, i, m, addresses, j, options) {
                n = split(suites, list, /[ \t]+/)
                for (i = 1; i <= n; i++) {
                    if (list[i] != from || enabled ~ /^[Nn]o/ || types !~ /(^|[ \t])deb([ \t]|$)/) continue
                    options = ""
                    if (signed != "") options = options " signed-by=" signed
                    if (architectures != "") { gsub(/[ \t]+/, ",", architectures); options = options " arch=" architectures }
                    if (trusted != "") options = options " trusted=" trusted
                    m = split(uris, addresses, /[ \t]+/)
                    for (j = 1; j <= m; j++)
                        if (addresses[j] != "")
                            print "deb " (options == "" ? "" : "[" substr(options, 2) "] ") addresses[j] " " to " " components
                }
                suites = uris = types = components = signed = architectures = trusted = enabled = ""
            }
            /^#/ { next }
            /^[ \t]*$/ { flush_stanza(); next }
            {
                key = tolower($0); sub(/:.*/, "", key)
                value = $0; sub(/^[^:]*:[ \t]*/, "", value); sub(/[ \t]+$/, "", value)
                if (key == "suites") suites = value
                else if (key == "uris") uris = value
                else if (key == "types") types = value
                else if (key == "components") components = value
                else if (key == "signed-by") signed = value
                else if (key == "architectures") architectures = value
                else if (key == "trusted") trusted = value
                else if (key == "enabled") enabled = value
            }
            END { flush_stanza() }' "$file"
    done
}


install_mesa() {
    local codename
    codename=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
    [ -n "$codename" ] || fail "cannot tell the Debian release from /etc/os-release"
    if ! apt-cache policy mesa-vulkan-drivers | grep -q "$codename-backports"; then
        local entries
        # Only the archive that carries the main suite is copied; its backports live beside it.
        entries=$(derive_sources "$codename" "$codename-backports" | sort -u)
        [ -n "$entries" ] || fail "no apt source for suite '$codename' found to derive '$codename-backports' from"
        printf '# Written by tests/setup.sh of q3rays: Mesa 25 for lavapipe with ray query.\n%s\n' "$entries" |
            as_root tee /etc/apt/sources.list.d/q3rays-backports.list >/dev/null
    fi
    quietly as_root apt-get update
    quietly as_root env DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends \
        -t "$codename-backports" mesa-vulkan-drivers
    mesa_is_new_enough || fail "mesa-vulkan-drivers is '$(installed_version mesa-vulkan-drivers)'; version $mesa_minimum or newer is needed"
}

install_missing() {
    local package missing=()
    for package in "${packages[@]}"; do
        [ -n "$(installed_version "$package")" ] || missing+=("$package")
    done
    [ "${#missing[@]}" -gt 0 ] || return 0
    echo "tests/setup.sh: installing ${missing[*]}"
    quietly as_root apt-get update
    quietly as_root env DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends "${missing[@]}"
}

check_vulkan() {
    local summary
    summary=$(vulkaninfo 2>/dev/null) || fail "vulkaninfo finds no working Vulkan driver"
    grep -q llvmpipe <<<"$summary" || fail "vulkaninfo lists no llvmpipe device"
    grep -q VK_KHR_ray_query <<<"$summary" || fail "no Vulkan device here has VK_KHR_ray_query"
}

command -v apt-get >/dev/null || fail "only Debian and its kin are handled; install these by hand: mesa-vulkan-drivers (>= $mesa_minimum) ${packages[*]}"
changed=no
if ! mesa_is_new_enough; then
    echo "tests/setup.sh: installing mesa-vulkan-drivers $mesa_minimum or newer"
    install_mesa
    changed=yes
fi
install_missing
[ "$changed" = no ] || check_vulkan
