# gapscope from its own .deb (scripts/package), in the Debian that it is built for. It has not been tried: where it was
# written no Docker daemon runs. From a clone (not from a git worktree, whose .git is elsewhere):
#   docker build -t gapscope .
#   docker run --rm -v "$PWD:/work" gapscope diagnose experiment.yaml log.csv --out out
FROM debian:bookworm-20250520-slim AS build
RUN apt-get update && apt-get install -y --no-install-recommends ca-certificates git
COPY . /source
WORKDIR /source
RUN scripts/package --out /packages

FROM debian:bookworm-20250520-slim
COPY --from=build /packages/*.deb /packages/
RUN apt-get update && apt-get install -y /packages/*.deb && rm -rf /packages /var/lib/apt/lists/*
WORKDIR /work
ENTRYPOINT ["gapscope"]
CMD ["--help"]
