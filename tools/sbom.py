#!/usr/bin/env python3
"""The software bill of materials of a built program: SPDX 2.3 as JSON on stdout.

Usage: sbom.py PROGRAM [--check]
  PROGRAM   what was built, e.g. build/bin/whirl
  --check   prints nothing; exit code 1 and one line per shared library that no package provides

One entry for whirl and one for each Debian package whose shared libraries the program loads, with version, source package and the
path of its copyright file. The licences of the packages stand there; this list does not repeat them (NOASSERTION).
"""
import argparse
import datetime
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]


def output(*words):
    return subprocess.run([str(w) for w in words], capture_output=True, text=True, check=True).stdout


def libraries(program):
    """Paths of the shared libraries that the program loads, the loader too."""
    return sorted(set(re.findall(r"(/\S+) \(0x", output("ldd", program))))


def packages_of(paths):
    """library -> its Debian package; None where no package has it. A merged /usr knows a file by one of two names."""
    names = {}
    for path in paths:
        real = os.path.realpath(path)
        for name in (path, real, real.removeprefix("/usr"), "/usr" + path):
            names.setdefault(name, path)
    found = dict.fromkeys(paths)
    listing = subprocess.run(["dpkg-query", "-S", *names], capture_output=True, text=True).stdout
    for line in listing.splitlines():
        package, _, name = line.partition(": ")
        if name in names:
            found[names[name]] = package.split(",")[0]
    return found


def entry(name, version, **more):
    return {"SPDXID": "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", name), "name": name, "versionInfo": version,
            "downloadLocation": "NOASSERTION", "filesAnalyzed": False, **more}


def bill(program):
    """(document, libraries without a package)"""
    version = re.search(r"project\(whirl VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
    digest = hashlib.sha256(pathlib.Path(program).read_bytes()).hexdigest()
    packages, homeless = {}, []
    for library, package in packages_of(libraries(program)).items():
        if package is None:
            homeless.append(library)
        else:
            packages.setdefault(package, []).append(os.path.basename(library))
    entries = [entry("whirl", version, licenseDeclared="BSD-3-Clause", licenseConcluded="NOASSERTION",
                     comment="own code; linked with GiNaC and FFTW the program as a whole is under the GPL",
                     checksums=[{"algorithm": "SHA256", "checksumValue": digest}])]
    for package in sorted(packages):
        source, number = output("dpkg-query", "-W", "-f", "${source:Package} ${Version}", package).split(" ")
        plain = package.partition(":")[0]
        entries.append(entry(plain, number, supplier="Organization: Debian", sourceInfo=f"source package {source}",
                             licenseDeclared="NOASSERTION", licenseConcluded="NOASSERTION",
                             comment=f"/usr/share/doc/{plain}/copyright; loads " + ", ".join(sorted(packages[package]))))
    whirl = entries[0]["SPDXID"]
    when = datetime.datetime.fromtimestamp(int(os.environ.get("SOURCE_DATE_EPOCH", pathlib.Path(program).stat().st_mtime)), datetime.timezone.utc)
    document = {
        "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": f"whirl-{version}",
        "documentNamespace": f"urn:whirl:sbom:{version}:{digest[:16]}",
        "creationInfo": {"created": when.strftime("%Y-%m-%dT%H:%M:%SZ"), "creators": ["Tool: whirl tools/sbom.py"]},
        "packages": entries,
        "relationships": [{"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES", "relatedSpdxElement": whirl}] +
                         [{"spdxElementId": whirl, "relationshipType": "DYNAMIC_LINK", "relatedSpdxElement": e["SPDXID"]} for e in entries[1:]],
    }
    return document, homeless


def main():
    options = argparse.ArgumentParser()
    options.add_argument("program")
    options.add_argument("--check", action="store_true")
    given = options.parse_args()
    document, homeless = bill(given.program)
    names = [e["SPDXID"] for e in document["packages"]]
    wrong = [f"{library}: in no package" for library in homeless]
    wrong += [f"{name}: twice" for name in sorted(set(names)) if names.count(name) > 1]
    if len(names) < 10:
        wrong.append(f"{len(names)} packages: too few to be all")
    if given.check:
        print("\n".join(wrong))
    else:
        print(json.dumps(document, indent=2))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
