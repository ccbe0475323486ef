# whirl from its Debian package: `make deb`, then `docker build -t whirl .` and `docker run --rm -v "$PWD:/work" whirl identify rundown.csv`.
# tools/prove-packages runs these steps in a fresh Debian root.
FROM debian:bookworm-slim
COPY build-deb/whirl_*.deb /packages/
RUN apt-get update -qq \
 && apt-get install -y -qq --no-install-recommends /packages/whirl_*.deb \
 && rm -rf /packages /var/lib/apt/lists/*
WORKDIR /work
ENTRYPOINT ["whirl"]
