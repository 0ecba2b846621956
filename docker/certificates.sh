#!/usr/bin/env bash
# Makes the certificates and passwords of compose.cluster.yaml in docker/secrets, once.
# Needs openssl. Files that exist are kept, so that it may be called again.
set -euo pipefail
umask 077
mkdir -p "$(dirname "$0")/secrets"
cd "$(dirname "$0")/secrets"

authority() {
    [[ -f ca.crt ]] || openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes \
        -days 3650 -subj "/CN=Chainage cluster" -keyout ca.key -out ca.crt 2>/dev/null
}

# certificate NAME SUBJECT-ALTERNATIVE-NAMES
certificate() {
    [[ -f $1.crt ]] && return
    openssl req -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -subj "/CN=$1" \
        -addext "subjectAltName=$2" -keyout "$1.key" -out "$1.csr" 2>/dev/null
    openssl x509 -req -in "$1.csr" -CA ca.crt -CAkey ca.key -CAcreateserial -days 825 \
        -copy_extensions copy -out "$1.crt" 2>/dev/null
    rm "$1.csr"
}

password() {
    openssl rand -hex 24
}

authority
# Scheduler, workers and server identify themselves by the same certificate.
certificate node "DNS:scheduler,DNS:worker,DNS:web,DNS:localhost"
certificate proxy "DNS:${CHAINAGE_HOST:-localhost}"
if [[ ! -f postgres-password ]]; then
    secret=$(password)
    printf '%s' "$secret" >postgres-password
    printf 'CHAINAGE_DATABASE=postgresql://chainage:%s@postgres/chainage\n' "$secret" >database.env
fi
if [[ ! -f store.env ]]; then
    secret=$(password)
    printf 'AWS_SECRET_ACCESS_KEY=%s\n' "$secret" >store.env
    cat >store.json <<JSON
{"identities": [{"name": "chainage",
  "credentials": [{"accessKey": "chainage", "secretKey": "$secret"}],
  "actions": ["Admin", "Read", "Write", "List", "Tagging"]}]}
JSON
fi
# Each container reads its own secrets as another user.
chmod 0444 ./*.crt node.key proxy.key postgres-password store.json
echo "docker/secrets is ready; keep it to yourself."
