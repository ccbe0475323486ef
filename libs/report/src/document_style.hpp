#pragma once
#include <string_view>

namespace whirl::report {

/// Style sheet of the page: one column of readable width, light and dark scheme, print rules.
inline constexpr std::string_view kDocumentStyle = R"css(
:root{--text:#1f2328;--muted:#57606a;--line:#d0d7de;--page:#ffffff;--panel:#f6f8fa;--link:#0b62a8;
--good:#1a7f37;--bad:#b42318;--warn:#8a5a00;--info:#0b62a8}
@media screen and (prefers-color-scheme:dark){:root{--text:#e6e9ec;--muted:#9aa4ae;--line:#30363d;--page:#0d1117;
--panel:#161b22;--link:#6cb6ff;--good:#57c26f;--bad:#ff8a7a;--warn:#e3b341;--info:#6cb6ff}}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{margin:0;background:var(--page);color:var(--text);
font:16px/1.55 "Helvetica Neue",Helvetica,Arial,"Liberation Sans",sans-serif}
main{max-width:860px;margin:0 auto;padding:2.5rem 1.25rem 4rem}
h1{font-size:1.9rem;line-height:1.2;margin:0 0 .3rem}
h2{font-size:1.35rem;margin:2.6rem 0 .8rem;padding-bottom:.25rem;border-bottom:1px solid var(--line)}
h3{font-size:1.08rem;margin:1.8rem 0 .5rem}
p,ul{margin:.7rem 0;max-width:70ch}
a{color:var(--link)}
.subtitle{color:var(--muted);font-size:1.05rem;margin:0 0 1.5rem}
nav{background:var(--panel);border:1px solid var(--line);border-radius:6px;padding:.8rem 1.2rem;margin:1.2rem 0;font-size:.94rem}
nav ol{margin:.3rem 0;padding-left:1.5rem}
nav a{text-decoration:none}
nav a:hover{text-decoration:underline}
figure{margin:1.6rem 0}
figure .drawing{overflow-x:auto}
figure svg{display:block;max-width:100%;height:auto}
figcaption,caption{color:var(--muted);font-size:.9rem;text-align:left;margin-top:.4rem;max-width:80ch}
figcaption b{color:var(--text)}
.wf path,.wf rect,.wf line{vector-effect:non-scaling-stroke}
.live .wf svg[data-p]{cursor:crosshair}.live .wf .lg{cursor:pointer}.wf .lg.off{opacity:.35}
.wf .cur{stroke:var(--muted);stroke-width:1;stroke-dasharray:3 2;pointer-events:none}.wf .sel{fill:var(--link);opacity:.18;pointer-events:none}
.wf .rd{pointer-events:none}.wf .rd rect{fill:var(--panel);stroke:var(--line);opacity:.94}
.table{margin:1.4rem 0;overflow-x:auto;width:max-content;min-width:100%;max-width:calc(50vw + 385px)}
@media screen{td.r,td.c{white-space:nowrap}}
@media (max-width:900px){.table{width:auto;max-width:100%}}
@media screen and (max-width:860px){figure svg.wf{max-width:none}}
table{border-collapse:collapse;font-size:.92rem;font-variant-numeric:tabular-nums}
caption{padding-bottom:.5rem;caption-side:top;color:var(--text)}
th,td{padding:.32rem .8rem;border-bottom:1px solid var(--line);vertical-align:top}
thead th{border-bottom:2px solid var(--muted);font-weight:600;vertical-align:bottom}
tbody th{font-weight:400}
.unit{color:var(--muted);font-weight:400}
.l{text-align:left}.r{text-align:right}.c{text-align:center}
.note{color:var(--muted);font-size:.85rem;margin:.3rem 0}
.equation{display:flex;align-items:center;gap:1rem;margin:1rem 0;overflow-x:auto}
.equation math{flex:1;font-size:1.08rem}
details{font-size:.85rem;color:var(--muted)}details pre{color:var(--text)}
.equation .number{color:var(--muted)}
math mtable.aligned mtd{text-align:left;padding:.12em .15em}
math mtable.aligned mtd:first-child{text-align:right}
dl.values{display:grid;grid-template-columns:max-content 1fr;gap:.25rem 1.2rem;margin:1rem 0;font-size:.94rem}
dl.values dt{color:var(--muted)}
dl.values dd{margin:0;overflow-wrap:anywhere;font-variant-numeric:tabular-nums}
dl.provenance{font-size:.82rem}
dl.provenance dd{font-family:ui-monospace,"DejaVu Sans Mono",Menlo,Consolas,monospace}
aside{border-left:4px solid var(--info);background:var(--panel);padding:.7rem 1rem;margin:1.2rem 0;border-radius:0 6px 6px 0}
aside p{margin:.3rem 0 0}
aside.good{border-color:var(--good)}aside.good b{color:var(--good)}
aside.bad{border-color:var(--bad)}aside.bad b{color:var(--bad)}
aside.warn{border-color:var(--warn)}aside.warn b{color:var(--warn)}
aside.info b{color:var(--info)}
pre{background:var(--panel);border:1px solid var(--line);border-radius:6px;padding:.8rem 1rem;overflow-x:auto;font-size:.86rem}
code{font-family:ui-monospace,"DejaVu Sans Mono",Menlo,Consolas,monospace}
@page{size:A4;margin:16mm 14mm}
@media print{html{font-size:12px}body{font-size:1rem}main{max-width:none;padding:0}
figure,table,aside,.equation,pre{break-inside:avoid}h2,h3{break-after:avoid}figcaption{break-before:avoid}
.wf .cur,.wf .sel,.wf .rd{display:none}.table{width:auto;max-width:none}details{display:none}nav{break-inside:avoid}a{color:inherit;text-decoration:none}figure .drawing,.table,.equation{overflow:visible}
figure svg{max-width:82%}table{font-size:.84rem}th,td{padding:.25rem .4rem}.l{overflow-wrap:anywhere}.note,figcaption,p,ul{max-width:none}}
)css";

}  // namespace whirl::report
