#pragma once

namespace whirl::pages {

/// HTML, style and script around the data of a modal page; `const data = ` ends the first part.
inline constexpr const char* kModalPageHead = R"page(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>Modal test</title><style>
:root{color-scheme:light dark;--ink:#1c2430;--soft:#68727f;--line:#c9d0d8;--back:#fff;--mark:#0b6bcb;--hot:#c2410c}
@media(prefers-color-scheme:dark){:root{--ink:#e7ebf0;--soft:#9aa5b1;--line:#3b444f;--back:#14181d;--mark:#5aa9f8;--hot:#fb923c}}
@media print{:root{--ink:#000;--soft:#444;--line:#bbb;--back:#fff;--mark:#0b4f9c;--hot:#a33}}
body{font:15px/1.45 system-ui,sans-serif;color:var(--ink);background:var(--back);max-width:1060px;margin:1.5rem auto;padding:0 1rem}
h1{font-size:1.35rem;margin:0 0 .3rem}h2{font-size:1.05rem;margin:1.6rem 0 .4rem}p{margin:.3rem 0;color:var(--soft)}
svg{width:100%;height:auto;display:block}svg text{fill:var(--soft);font-size:12px}
.axis{stroke:var(--line)}.meas{stroke:var(--soft);fill:none}.fit{stroke:var(--mark);fill:none}.res{stroke:var(--hot);fill:none}
.pole{fill:var(--line);cursor:pointer}.pole.stable{fill:var(--soft)}.pole.on{fill:var(--mark)}
.chosen{stroke:var(--mark);stroke-dasharray:4 3}button,select{font:inherit;color:inherit;background:none;border:1px solid var(--line);border-radius:4px;padding:.15rem .5rem;margin:.1rem}
button.on{background:var(--mark);color:#fff;border-color:var(--mark)}code{display:block;padding:.5rem;border:1px solid var(--line);border-radius:4px;overflow-wrap:anywhere}
.two{display:grid;grid-template-columns:1fr 1fr;gap:1.2rem}@media(max-width:760px){.two{grid-template-columns:1fr}}
.wire{stroke:var(--mark);stroke-width:1.6}.rest{stroke:var(--line)}.dot{fill:var(--mark)}.arrow{stroke:var(--mark);stroke-width:1.6}
</style></head><body>
<h1>Modal test</h1><p id="summary"></p>
<h2>Stabilisation diagram</h2><p>Dark dots are stable poles. A click on a dot adds or removes that mode; the command below fits the choice.</p>
<svg id="stab" viewBox="0 0 1000 380"></svg><code id="command"></code>
<h2>Shapes</h2><div id="modes"></div><div class="two"><div><svg id="shape" viewBox="0 0 480 360"></svg><p id="view"></p></div>
<div><svg id="complexity" viewBox="0 0 480 360"></svg><p>Complexity: every arrow is one point; a real mode lies on one line.</p></div></div>
<h2>MAC of the shapes</h2><svg id="mac" viewBox="0 0 480 480" style="max-width:520px"></svg>
<h2>Frequency responses</h2><select id="channel"></select><p id="residual"></p><svg id="frf" viewBox="0 0 1000 380"></svg>
<p>Grey: measured; blue: fitted; orange: measured less fitted.</p>
<script>const data = )page";

inline constexpr const char* kModalPageTail = R"page(;
const $=id=>document.getElementById(id),NS='http://www.w3.org/2000/svg';
function put(svg,tag,attributes,text){const e=document.createElementNS(NS,tag);for(const k in attributes)e.setAttribute(k,attributes[k]);if(text!==undefined)e.textContent=text;svg.append(e);return e}
function ticks(a,b,n){const raw=(b-a)/n,p=10**Math.floor(Math.log10(raw)),s=[1,2,5,10].map(m=>m*p).find(s=>s>=raw);const r=[];for(let v=Math.ceil(a/s)*s;v<=b+1e-9*s;v+=s)r.push(+v.toPrecision(10));return r}
const chosen=new Set(data.chosen.map(f=>f)),box={l:60,r:990,t:12,b:340};
const lo=data.band[0],hi=data.band[1],X=f=>box.l+(box.r-box.l)*(f-lo)/(hi-lo);
function xAxis(svg,unit){for(const f of ticks(lo,hi,10)){put(svg,'line',{x1:X(f),x2:X(f),y1:box.t,y2:box.b,class:'axis'});put(svg,'text',{x:X(f),y:box.b+16,'text-anchor':'middle'},f)}put(svg,'text',{x:box.r,y:box.b+32,'text-anchor':'end'},unit)}
function curve(svg,f,y,Y,cls){let d='';for(let i=0;i<f.length;i++)if(isFinite(y[i]))d+=(d?'L':'M')+X(f[i]).toFixed(1)+' '+Y(y[i]).toFixed(1);put(svg,'path',{d,class:cls})}
const near=f=>{for(const c of chosen)if(Math.abs(c/f-1)<2e-3)return c;return null};
function stab(){const s=$('stab');s.replaceChildren();xAxis(s,'frequency, Hz');
 const o=data.poles.map(p=>p[0]),o0=Math.min(...o),o1=Math.max(...o,o0+1),Y=v=>box.b-8-(box.b-box.t-20)*(v-o0)/(o1-o0);
 const m=data.sum.map(v=>20*Math.log10(v)),m0=Math.min(...m.filter(isFinite)),m1=Math.max(...m);
 curve(s,data.f,m,v=>box.b-(box.b-box.t)*(v-m0)/(m1-m0||1),'meas');
 for(const v of ticks(o0,o1,6))put(s,'text',{x:box.l-6,y:Y(v)+4,'text-anchor':'end'},v);
 put(s,'text',{x:14,y:180,transform:'rotate(-90 14 180)','text-anchor':'middle'},'order');
 for(const c of chosen)put(s,'line',{x1:X(c),x2:X(c),y1:box.t,y2:box.b,class:'chosen'});
 for(const p of data.poles){const on=near(p[1])!==null;const e=put(s,'circle',{cx:X(p[1]),cy:Y(p[0]),r:p[3]?4:2.6,class:'pole'+(p[3]?' stable':'')+(on?' on':'')});
  put(e,'title',{},'order '+p[0]+', '+p[1].toPrecision(7)+' Hz, '+(100*p[2]).toPrecision(3)+' %');
  e.onclick=()=>{const c=near(p[1]);c===null?chosen.add(p[1]):chosen.delete(c);stab()}}
 const list=[...chosen].sort((a,b)=>a-b).map(f=>+f.toPrecision(7));
 $('command').textContent=data.command+(list.length?' --select '+list.join(' '):'')}
let mode=0,turn=[.6,-.5],began=performance.now();
function project(p){const [a,b]=turn,x=p[0]*Math.cos(a)-p[1]*Math.sin(a),y=p[0]*Math.sin(a)+p[1]*Math.cos(a);return[x,-(p[2]*Math.cos(b)-y*Math.sin(b))]}
const still=matchMedia('(prefers-reduced-motion: reduce)').matches;
function shape(now){const s=$('shape');if(data.modes.length&&data.nodes.length){const m=data.modes[mode],n=data.nodes;
 const c=[0,1,2].map(k=>n.reduce((t,q)=>t+q[k],0)/n.length),size=Math.max(1e-9,...n.map(q=>Math.hypot(q[0]-c[0],q[1]-c[1],q[2]-c[2])));
 const t=still?0:(now-began)/1000*2*Math.PI*.6,big=Math.max(1e-300,...m.motion.map(v=>Math.hypot(...v)));
 const at=(i,g)=>{const v=m.motion[i],p=[0,1,2].map(k=>n[i][k]-c[k]+g*.35*size/big*(v[2*k]*Math.cos(t)-v[2*k+1]*Math.sin(t)));const q=project(p);return[240+150*q[0]/size,180+150*q[1]/size]};
 s.replaceChildren();for(const g of[0,1]){const pts=n.map((_,i)=>at(i,g));for(const[a,b]of data.lines)put(s,'line',{x1:pts[a][0],y1:pts[a][1],x2:pts[b][0],y2:pts[b][1],class:g?'wire':'rest'});
  if(g)for(const p of pts)put(s,'circle',{cx:p[0],cy:p[1],r:3,class:'dot'})}}
 if(!still)requestAnimationFrame(shape)}
$('shape').onpointermove=e=>{if(e.buttons){turn[0]+=e.movementX*.01;turn[1]+=e.movementY*.01;if(still)shape(0)}};
function complexity(){const s=$('complexity');s.replaceChildren();if(!data.modes.length)return;put(s,'circle',{cx:240,cy:175,r:140,fill:'none',class:'axis'});
 put(s,'line',{x1:100,x2:380,y1:175,y2:175,class:'axis'});put(s,'line',{x1:240,x2:240,y1:35,y2:315,class:'axis'});
 const v=data.modes[mode].shape,big=Math.max(1e-300,...v.map(c=>Math.hypot(...c)));
 v.forEach((c,i)=>{const e=put(s,'line',{x1:240,y1:175,x2:240+140*c[0]/big,y2:175-140*c[1]/big,class:'arrow'});put(e,'title',{},data.points[i])});
 put(s,'text',{x:240,y:345,'text-anchor':'middle'},'MPC '+data.modes[mode].mpc.toFixed(3)+', mean phase deviation '+(data.modes[mode].mpd*180/Math.PI).toFixed(1)+'°')}
function buttons(){const d=$('modes');d.replaceChildren();data.modes.forEach((m,i)=>{const b=document.createElement('button');b.textContent=m.f.toPrecision(5)+' Hz';b.className=i===mode?'on':'';b.onclick=()=>{mode=i;buttons();complexity();if(still)shape(0)};d.append(b)});
 if(data.modes.length){const m=data.modes[mode];$('view').textContent=m.f.toPrecision(6)+' Hz, damping '+(100*m.z).toPrecision(3)+' %. Drag to turn.'}}
function mac(){const s=$('mac'),n=data.modes.length;if(!n)return;const a=410/n;for(let i=0;i<n;i++)for(let j=0;j<n;j++){const v=data.mac[i][j];const e=put(s,'rect',{x:60+j*a,y:10+i*a,width:a-1,height:a-1,fill:'var(--mark)','fill-opacity':v.toFixed(3),stroke:'var(--line)','stroke-width':.5});
  put(e,'title',{},data.modes[i].f.toPrecision(5)+' / '+data.modes[j].f.toPrecision(5)+' Hz: '+v.toFixed(3))}
 const step=Math.ceil(n/12);for(let i=0;i<n;i+=step){put(s,'text',{x:55,y:14+i*a+a/2,'text-anchor':'end'},data.modes[i].f.toPrecision(4));put(s,'text',{x:60+i*a+a/2,y:436,'text-anchor':'middle',transform:`rotate(45 ${60+i*a+a/2} 436)`},data.modes[i].f.toPrecision(4))}
 put(s,'text',{x:265,y:474,'text-anchor':'middle'},'frequency, Hz')}
function frf(){const s=$('frf'),c=data.channels[$('channel').value||0];s.replaceChildren();xAxis(s,'frequency, Hz');const db=v=>v.map(x=>20*Math.log10(x)),m=db(c.measured),q=db(c.fitted),r=db(c.residual);
 const all=[...m,...q].filter(isFinite),a=Math.min(...all)-25,b=Math.max(...all)+3,Y=v=>box.b-(box.b-box.t)*(Math.max(v,a)-a)/(b-a);
 for(const v of ticks(a,b,6)){put(s,'line',{x1:box.l,x2:box.r,y1:Y(v),y2:Y(v),class:'axis'});put(s,'text',{x:box.l-6,y:Y(v)+4,'text-anchor':'end'},v)}
 put(s,'text',{x:14,y:180,transform:'rotate(-90 14 180)','text-anchor':'middle'},'dB re 1 '+data.unit);
 curve(s,data.f,r,Y,'res');curve(s,data.f,m,Y,'meas');curve(s,data.f,q,Y,'fit');$('residual').textContent='Residual '+(100*c.error).toPrecision(3)+' % of this FRF.'}
data.channels.forEach((c,i)=>{const o=document.createElement('option');o.value=i;o.textContent=c.name+' ('+(100*c.error).toPrecision(2)+' %)';$('channel').append(o)});
$('channel').onchange=frf;$('summary').textContent=data.summary;stab();buttons();complexity();mac();frf();shape(began);
</script></body></html>
)page";

}  // namespace whirl::pages
