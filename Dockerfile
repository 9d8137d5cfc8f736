# softdock on CPU lanes and on the software GPU lavapipe.
#
#   docker build -t softdock .
#   docker run --rm -v "$PWD:/work" softdock init dock dock
#   docker run --rm -v "$PWD:/work" softdock run dock/probe_drogue.toml --runs 400

FROM rust:1-slim-trixie AS build
WORKDIR /softdock
COPY . .
RUN cargo build --locked --profile dist

FROM debian:trixie-slim
RUN apt-get update -qq \
    && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends libvulkan1 mesa-vulkan-drivers \
    && rm -rf /var/lib/apt/lists/*
COPY --from=build /softdock/target/dist/softdock /usr/local/bin/softdock
WORKDIR /work
ENTRYPOINT ["softdock"]
CMD ["--help"]
